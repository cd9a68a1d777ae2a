//! Which file of a crate takes what from which other file, read from the paths in its code.
//!
//! A name is followed through `pub use` to the file that defines it; a `mod` and a `pub use` are no arrows themselves,
//! and code under `cfg(test)` is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree, Visibility};

/// From each file to the files that it takes names from, with the names; paths are relative to `src`.
pub type Arrows = BTreeMap<String, BTreeMap<String, BTreeSet<String>>>;

/// A module: its file, and what is in it.
#[derive(Default)]
struct Module {
    file: String,
    children: BTreeSet<String>,
    defined: BTreeSet<String>,
    /// Names that `use` brings in, and the paths that they stand for.
    aliases: BTreeMap<String, Vec<String>>,
    globs: Vec<Vec<String>>,
    items: Vec<Item>,
}

type Modules = BTreeMap<Vec<String>, Module>;

/// Reads all files of a crate, from its `lib.rs` or `main.rs`.
pub fn arrows(source: &Path) -> Arrows {
    let mut modules = Modules::new();
    let root = if source.join("lib.rs").is_file() { "lib.rs" } else { "main.rs" };
    read(source, root, Vec::new(), &mut modules);
    let mut arrows = Arrows::new();
    for (path, module) in &modules {
        let mut paths = Paths::default();
        for item in &module.items {
            paths.visit_item(item);
        }
        for wanted in paths.found {
            if let Some((file, name)) = find(&modules, path, &wanted, 0).filter(|(file, _)| *file != module.file) {
                arrows.entry(module.file.clone()).or_default().entry(file).or_default().insert(name);
            }
        }
    }
    arrows
}

/// Groups of files each of which takes something from each other one, directly or through others.
pub fn circles(arrows: &Arrows) -> Vec<Vec<String>> {
    let reach: BTreeMap<&String, BTreeSet<&String>> = arrows.keys().map(|from| (from, reached(arrows, from))).collect();
    let mut circles = BTreeSet::new();
    for (from, all) in &reach {
        if all.contains(from) {
            let back = |to: &&&String| reach.get(**to).is_some_and(|there| there.contains(from));
            circles.insert(all.iter().filter(back).map(|it| (*it).clone()).collect::<Vec<_>>());
        }
    }
    circles.into_iter().collect()
}

/// The imports in a folder's files that reach into several modules at once; rustfmt's stable settings let them pass.
pub fn nested(folder: &Path) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap_or_else(|error| panic!("{}: {error}", folder.display())).path();
        if path.is_dir() {
            found.extend(nested(&path));
        } else if path.extension().is_some_and(|it| it == "rs") {
            let text = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let mut nests = Nests::default();
            nests.visit_file(&parsed);
            found.extend(nests.found.iter().map(|it| format!("{}: {it}", path.display())));
        }
    }
    found
}

/// Collects imports whose braces hold paths.
#[derive(Default)]
struct Nests {
    found: Vec<String>,
}

impl<'ast> Visit<'ast> for Nests {
    fn visit_use_group(&mut self, group: &'ast syn::UseGroup) {
        self.found.extend(group.items.iter().filter_map(|tree| match tree {
            UseTree::Path(it) => Some(format!("{}::", it.ident)),
            _ => None,
        }));
        visit::visit_use_group(self, group);
    }
}

fn reached<'a>(arrows: &'a Arrows, from: &'a String) -> BTreeSet<&'a String> {
    let mut all = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        open.extend(arrows.get(file).into_iter().flat_map(BTreeMap::keys).filter(|to| all.insert(*to)));
    }
    all
}

fn read(source: &Path, file: &str, path: Vec<String>, modules: &mut Modules) {
    let text = fs::read_to_string(source.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
    let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{file}: {error}"));
    enter(source, file, path, parsed.items, modules);
}

/// Files a module's items, and reads the modules inside it.
fn enter(source: &Path, file: &str, path: Vec<String>, items: Vec<Item>, modules: &mut Modules) {
    let mut module = Module { file: file.to_owned(), ..Module::default() };
    for item in items {
        match item {
            Item::Mod(inner) if !is_test(&inner.attrs) => {
                let name = inner.ident.to_string();
                module.children.insert(name.clone());
                let below = [path.clone(), vec![name.clone()]].concat();
                match inner.content {
                    Some((_, items)) => enter(source, file, below, items, modules),
                    None => read(source, &child_file(source, file, &name), below, modules),
                }
            }
            Item::Use(item) if !is_test(&item.attrs) => {
                bring_in(&mut module, &item.tree, Vec::new());
                if matches!(item.vis, Visibility::Inherited) {
                    module.items.push(Item::Use(item));
                }
            }
            item => file_away(&mut module, item),
        }
    }
    modules.insert(path, module);
}

fn file_away(module: &mut Module, item: Item) {
    let (name, attributes) = match &item {
        Item::Const(it) => (Some(&it.ident), &it.attrs),
        Item::Enum(it) => (Some(&it.ident), &it.attrs),
        Item::Fn(it) => (Some(&it.sig.ident), &it.attrs),
        Item::Static(it) => (Some(&it.ident), &it.attrs),
        Item::Struct(it) => (Some(&it.ident), &it.attrs),
        Item::Trait(it) => (Some(&it.ident), &it.attrs),
        Item::Type(it) => (Some(&it.ident), &it.attrs),
        Item::Impl(it) => (None, &it.attrs),
        Item::Macro(it) => (it.ident.as_ref(), &it.attrs),
        _ => return,
    };
    if !is_test(attributes) {
        module.defined.extend(name.map(ToString::to_string));
        module.items.push(item);
    }
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|it| it.path().is_ident("cfg") && quoted(it).contains("test"))
}

fn quoted(attribute: &Attribute) -> String {
    attribute.meta.require_list().map(|list| list.tokens.to_string()).unwrap_or_default()
}

fn child_file(source: &Path, file: &str, name: &str) -> String {
    let folder = match file.rsplit_once('/') {
        Some((folder, "mod.rs")) => format!("{folder}/"),
        None if file == "lib.rs" || file == "main.rs" => String::new(),
        _ => format!("{}/", file.trim_end_matches(".rs")),
    };
    let [flat, nested] = [format!("{folder}{name}.rs"), format!("{folder}{name}/mod.rs")];
    if source.join(&flat).is_file() { flat } else { nested }
}

fn bring_in(module: &mut Module, tree: &UseTree, before: Vec<String>) {
    let with = |name: &syn::Ident| [before.clone(), vec![name.to_string()]].concat();
    match tree {
        UseTree::Path(it) => bring_in(module, &it.tree, with(&it.ident)),
        UseTree::Group(it) => it.items.iter().for_each(|tree| bring_in(module, tree, before.clone())),
        UseTree::Glob(_) => module.globs.push(before),
        UseTree::Name(it) if it.ident == "self" => {
            if let Some(last) = before.last() {
                module.aliases.insert(last.clone(), before);
            }
        }
        UseTree::Name(it) => drop(module.aliases.insert(it.ident.to_string(), with(&it.ident))),
        UseTree::Rename(it) => drop(module.aliases.insert(it.rename.to_string(), with(&it.ident))),
    }
}

/// The file that defines what a path in a module means, and its name; `None` if that is not in this crate.
fn find(modules: &Modules, here: &[String], wanted: &[String], depth: usize) -> Option<(String, String)> {
    let (first, rest) = wanted.split_first()?;
    if depth > 16 {
        return None;
    }
    let at = |place: &[String]| -> Option<(String, String)> {
        match rest {
            [] => Some((modules.get(place)?.file.clone(), first.clone())),
            _ => find(modules, place, rest, depth + 1),
        }
    };
    let module = modules.get(here)?;
    match first.as_str() {
        "crate" => at(&[]),
        "self" => at(here),
        "super" => at(&here[..here.len().checked_sub(1)?]),
        name if module.defined.contains(name) => Some((module.file.clone(), name.to_owned())),
        name if module.children.contains(name) => at(&[here, &[name.to_owned()]].concat()),
        name => {
            if let Some(alias) = module.aliases.get(name).filter(|alias| alias.as_slice() != [name]) {
                return find(modules, here, &[alias, rest].concat(), depth + 1);
            }
            let through = |glob: &Vec<String>| find(modules, here, &[glob, wanted].concat(), depth + 1);
            module.globs.iter().filter(|glob| glob.first().is_some_and(|it| it != name)).find_map(through)
        }
    }
}

/// Collects the paths of a module's code.
#[derive(Default)]
struct Paths {
    found: Vec<Vec<String>>,
}

impl Paths {
    fn uses(&mut self, tree: &UseTree, before: &[String]) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(it) => self.uses(&it.tree, &with(&it.ident)),
            UseTree::Group(it) => it.items.iter().for_each(|tree| self.uses(tree, before)),
            UseTree::Name(it) if it.ident == "self" => {}
            UseTree::Name(it) => self.found.push(with(&it.ident)),
            UseTree::Rename(it) => self.found.push(with(&it.ident)),
            UseTree::Glob(_) => {}
        }
    }
}

impl<'ast> Visit<'ast> for Paths {
    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        self.uses(&item.tree, &[]);
    }

    fn visit_vis_restricted(&mut self, _: &'ast syn::VisRestricted) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.found.push(path.segments.iter().map(|it| it.ident.to_string()).collect());
        visit::visit_path(self, path);
    }
}
