//! Wrong input: what each program says of it, and its exit code.

mod bags;
mod missions;
mod nodes;
mod orders;
mod training;

use std::fmt::Write as _;

use crate::pins::golden;
use crate::pins::place::Place;

/// Files by name and text, and the command line that is to be refused.
type Case = (&'static [(&'static str, &'static str)], &'static str);

/// Holds what is said of some cases against a golden file.
fn refuse(name: &str, place: &Place, cases: &[Case]) {
    golden::check(&format!("refusals/{name}.txt"), &refusals(place, cases));
}

/// Runs each case, and collects what is said.
fn refusals(place: &Place, cases: &[Case]) -> String {
    let mut text = String::new();
    for (files, line) in cases {
        for (file, content) in *files {
            place.write(file, content);
            _ = writeln!(text, "# {file}: {}", content.replace('\n', "\n#   "));
        }
        place.remove("out");
        let said = place.run(line);
        let code = said.code.unwrap_or_else(|| panic!("{line} was ended by a signal: {}", said.stderr));
        assert!(!said.stderr.contains("panicked"), "{line}: {}", said.stderr);
        let said = format!("{}{}", said.stdout, said.stderr);
        // How fast a mission flies is another figure each time.
        let kept: Vec<&str> = said.lines().filter(|line| !line.contains("x real time")).collect();
        _ = writeln!(text, "$ {line}\n{}\nexit code {code}\n", kept.join("\n"));
    }
    text
}
