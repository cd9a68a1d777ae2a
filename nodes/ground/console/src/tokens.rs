//! Who may do what from other machines: tokens with a role and an end, of which only digests are kept.

use std::fmt::Write as _;
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, bail, ensure};
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use swath_mission::time_text;

/// What a caller may do.
#[derive(Clone, Copy, Debug, Deserialize, Serialize, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Role {
    /// Look.
    Viewer,
    /// Look, and command.
    Operator,
}

/// A token, without its secret.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Token {
    /// Whose it is; the trail says so.
    pub name: String,
    /// What its bearer may do.
    pub role: Role,
    /// When it ends, RFC 3339.
    pub expires: String,
    /// SHA-256 of the secret, in hexadecimal digits.
    pub digest: String,
}

/// The tokens of a file.
#[derive(Clone, Debug, Default, Deserialize, Serialize, PartialEq, Eq)]
#[serde(deny_unknown_fields)]
pub struct Tokens {
    /// All that were added and not revoked.
    #[serde(default, rename = "token")]
    pub tokens: Vec<Token>,
}

/// Longest name [characters].
const NAME_MAX: usize = 40;

impl Tokens {
    /// Reads a file; one that is not there holds none.
    ///
    /// # Errors
    /// When it cannot be read, or holds something else.
    pub fn read(path: &Path) -> Result<Self> {
        let text = match std::fs::read_to_string(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            text => text.with_context(|| format!("cannot read tokens {}", path.display()))?,
        };
        let tokens: Self = toml::from_str(&text).with_context(|| format!("{} holds no tokens", path.display()))?;
        for token in &tokens.tokens {
            end(token).with_context(|| format!("token {} of {}", token.name, path.display()))?;
        }
        Ok(tokens)
    }

    /// Writes a file that nobody else may read.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let unwritable = || format!("cannot write tokens {}", path.display());
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).with_context(unwritable)?;
        }
        // A file that is written in part would lock everybody out.
        let beside = path.with_extension("new");
        let mut options = std::fs::OpenOptions::new();
        let mut file =
            options.write(true).create(true).truncate(true).mode(0o600).open(&beside).with_context(unwritable)?;
        file.write_all(toml::to_string(self)?.as_bytes()).and_then(|()| file.sync_all()).with_context(unwritable)?;
        std::fs::rename(&beside, path).with_context(unwritable)
    }

    /// Adds a token and returns its secret, which is not kept.
    ///
    /// # Errors
    /// When the name is taken or is no name, or there is no randomness.
    pub fn add(&mut self, name: &str, role: Role, expires_ns: u64) -> Result<String> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_.@".contains(c);
        ensure!(
            !name.is_empty() && name.len() <= NAME_MAX && name.chars().all(plain),
            "name {name:?} must be 1 to {NAME_MAX} letters, digits or characters of -_.@"
        );
        if self.tokens.iter().any(|token| token.name == name) {
            bail!("there is a token of {name} already: revoke it first");
        }
        let mut secret = [0; 32];
        getrandom::fill(&mut secret).map_err(|error| anyhow::anyhow!("no randomness: {error}"))?;
        let secret = hexadecimal(&secret);
        let expires = time_text::format(expires_ns);
        self.tokens.push(Token { name: name.to_owned(), role, expires, digest: digest(&secret) });
        Ok(secret)
    }

    /// Takes a token away.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn revoke(&mut self, name: &str) -> Result<()> {
        let before = self.tokens.len();
        self.tokens.retain(|token| token.name != name);
        ensure!(self.tokens.len() < before, "there is no token of {name}");
        Ok(())
    }

    /// The token that a secret belongs to, if it has not ended.
    #[must_use]
    pub fn of(&self, secret: &str, now_ns: u64) -> Option<&Token> {
        // How long a comparison of digests takes tells nothing of the secret that they are made from.
        let digest = digest(secret);
        let found = self.tokens.iter().find(|token| token.digest == digest)?;
        end(found).is_ok_and(|end| now_ns < end).then_some(found)
    }
}

/// When a token ends [ns since 1970-01-01 UTC].
fn end(token: &Token) -> Result<u64> {
    time_text::parse(&token.expires).map_err(|error| anyhow::anyhow!("expires: {error}"))
}

fn digest(secret: &str) -> String {
    hexadecimal(&Sha256::digest(secret.as_bytes()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Wall-clock time [ns since 1970-01-01 UTC]: tokens end by it.
#[must_use]
pub fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or(Duration::ZERO);
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}

/// Where tokens are unless somebody says otherwise.
///
/// # Errors
/// When there is no home folder.
pub fn usual_file() -> Result<PathBuf> {
    let folder = std::env::var_os("XDG_CONFIG_HOME").filter(|it| !it.is_empty()).map(PathBuf::from);
    let home = || std::env::var_os("HOME").filter(|it| !it.is_empty()).map(|home| Path::new(&home).join(".config"));
    let folder = folder.or_else(home).context("there is no HOME to keep tokens in: --tokens says where")?;
    Ok(folder.join("swath/tokens.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_secret_opens_until_it_ends_or_is_revoked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/tokens.toml");
        let mut tokens = Tokens::read(&path).unwrap();
        assert_eq!(tokens, Tokens::default());
        let secret = tokens.add("alice", Role::Operator, 5_000_000_000).unwrap();
        assert_eq!(secret.len(), 64);
        tokens.write(&path).unwrap();
        assert!(!std::fs::read_to_string(&path).unwrap().contains(&secret), "the secret is not kept");
        let mut tokens = Tokens::read(&path).unwrap();
        assert_eq!(
            tokens.of(&secret, 4_999_999_999).map(|it| (it.name.as_str(), it.role)),
            Some(("alice", Role::Operator))
        );
        assert_eq!(tokens.of(&secret, 5_000_000_000), None, "it has ended");
        assert_eq!(tokens.of(&secret[1..], 0), None);
        assert_eq!(tokens.of("", 0), None);
        tokens.revoke("alice").unwrap();
        assert_eq!(tokens.of(&secret, 0), None);
        assert!(tokens.revoke("alice").unwrap_err().to_string().contains("no token of alice"));
    }

    #[test]
    fn names_are_of_one_bearer_and_readable_in_a_trail() {
        let mut tokens = Tokens::default();
        tokens.add("bob", Role::Viewer, 1).unwrap();
        assert!(tokens.add("bob", Role::Operator, 1).unwrap_err().to_string().contains("already"));
        for name in ["", "a b", "a\nb", "\u{1b}[2J", &"x".repeat(41)] {
            assert!(tokens.add(name, Role::Viewer, 1).is_err(), "{name:?}");
        }
    }

    #[test]
    fn a_file_with_something_else_is_told() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for text in [
            "token = 3",
            "[[token]]\nname = 'a'\nrole = 'king'\nexpires = 'x'\ndigest = ''",
            "[[token]]\nname = 'a'\nrole = 'viewer'\nexpires = 'soon'\ndigest = ''",
        ] {
            std::fs::write(file.path(), text).unwrap();
            assert!(Tokens::read(file.path()).is_err(), "{text}");
        }
    }
}
