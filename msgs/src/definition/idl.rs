//! Parser of the part of OMG IDL that ROS 2 makes interfaces of: modules, structs, typedefs of arrays, enums,
//! constants, annotations and comments.

use std::collections::BTreeMap;

use super::{Base, Definition, DefinitionError, Field, Named, Primitive, Shape};

/// Deepest nesting of modules and types that is read.
const MAX_DEPTH: usize = 32;

/// A word or sign of the text with its line.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Token<'a> {
    line: usize,
    text: &'a str,
}

/// The type of a member, as far as it is known while its names are not resolved.
type Kind = (Base, Shape);

/// Parses an IDL text whose first line has the number `first_line`.
pub(super) fn definitions(text: &str, first_line: usize) -> Result<Vec<Named>, DefinitionError> {
    let tokens = tokens(text, first_line)?;
    let mut parser = Parser { tokens: &tokens, at: 0, modules: Vec::new(), types: BTreeMap::new(), all: Vec::new() };
    while parser.peek().is_some() {
        parser.declaration()?;
    }
    Ok(parser.all)
}

/// Splits a text into words, numbers, texts and signs; comments and `#` lines are left out.
fn tokens(text: &str, first_line: usize) -> Result<Vec<Token<'_>>, DefinitionError> {
    let mut tokens = Vec::new();
    let (mut rest, mut line) = (text, first_line);
    while let Some(first) = rest.chars().next() {
        let len = if first.is_whitespace() {
            first.len_utf8()
        } else if first == '#' || rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if let Some(comment) = rest.strip_prefix("/*") {
            comment.find("*/").map_or(rest.len(), |end| end + 4)
        } else {
            let len = match first {
                '"' | '\'' => literal_len(rest, first),
                _ if is_word(first) => rest.find(|c: char| !is_word(c)).unwrap_or(rest.len()),
                _ if rest.starts_with("::") => 2,
                _ => first.len_utf8(),
            };
            tokens.push(Token { line, text: &rest[..len] });
            len
        };
        line += rest[..len].matches('\n').count();
        rest = &rest[len..];
    }
    Ok(tokens)
}

fn is_word(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '+' | '-')
}

/// The length of a text or character in quotes, with them.
fn literal_len(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices().skip(1) {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + 1,
            _ => {}
        }
    }
    text.len()
}

struct Parser<'a> {
    tokens: &'a [Token<'a>],
    at: usize,
    /// Names of the modules around.
    modules: Vec<&'a str>,
    /// What `typedef` and `enum` name, by full name `a::b::C`.
    types: BTreeMap<String, Kind>,
    all: Vec<Named>,
}

impl<'a> Parser<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.tokens.get(self.at).map(|token| token.text)
    }

    fn error(&self, reason: impl Into<String>) -> DefinitionError {
        let line = self.tokens.get(self.at).or(self.tokens.last()).map_or(1, |token| token.line);
        DefinitionError { line, reason: reason.into() }
    }

    fn next(&mut self) -> Result<&'a str, DefinitionError> {
        let token = self.peek().ok_or_else(|| self.error("the IDL ends early"))?;
        self.at += 1;
        Ok(token)
    }

    fn skip(&mut self, wanted: &str) -> bool {
        let found = self.peek() == Some(wanted);
        self.at += usize::from(found);
        found
    }

    fn expect(&mut self, wanted: &str) -> Result<(), DefinitionError> {
        if self.skip(wanted) {
            return Ok(());
        }
        let found = self.peek().unwrap_or("the end");
        Err(self.error(format!("`{wanted}` expected, found `{found}`")))
    }

    fn name(&mut self) -> Result<&'a str, DefinitionError> {
        match self.peek() {
            Some(name) if name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') => self.next(),
            found => Err(self.error(format!("a name expected, found `{}`", found.unwrap_or("the end")))),
        }
    }

    /// Passes over `@verbatim (…)` and the like.
    fn annotations(&mut self) -> Result<(), DefinitionError> {
        while self.skip("@") {
            self.name()?;
            while self.skip("::") {
                self.name()?;
            }
            if self.skip("(") {
                let mut open = 1;
                while open > 0 {
                    match self.next()? {
                        "(" => open += 1,
                        ")" => open -= 1,
                        _ => {}
                    }
                }
            }
        }
        Ok(())
    }

    fn declaration(&mut self) -> Result<(), DefinitionError> {
        self.annotations()?;
        match self.next()? {
            "module" => self.module(),
            "struct" => self.structure(),
            "typedef" => self.typedef(),
            "enum" => self.enumeration(),
            "const" => self.through_semicolon(),
            ";" => Ok(()),
            other => {
                self.at -= 1;
                Err(self.error(format!("`{other}` is not read, only modules, structs, typedefs, enums and constants")))
            }
        }
    }

    fn module(&mut self) -> Result<(), DefinitionError> {
        let name = self.name()?;
        if self.modules.len() >= MAX_DEPTH {
            return Err(self.error(format!("modules are nested deeper than {MAX_DEPTH}")));
        }
        self.modules.push(name);
        self.expect("{")?;
        while !self.skip("}") {
            self.declaration()?;
        }
        self.modules.pop();
        self.skip(";");
        Ok(())
    }

    fn structure(&mut self) -> Result<(), DefinitionError> {
        let name = self.name()?;
        if self.peek() == Some(":") {
            return Err(self.error("structs that extend others are not read"));
        }
        let mut definition = Definition::default();
        self.expect("{")?;
        while !self.skip("}") {
            self.annotations()?;
            let kind = self.kind(0)?;
            loop {
                let line = self.tokens.get(self.at).map_or(1, |token| token.line);
                let name = self.name()?.to_owned();
                let (base, shape) = self.array_of(kind.clone())?;
                definition.fields.push(Field { line, name, base, shape, default: None, doc: String::new() });
                if !self.skip(",") {
                    break;
                }
            }
            self.expect(";")?;
        }
        self.skip(";");
        let package = self.modules.first().copied().unwrap_or_default();
        self.all.push(Named { name: format!("{package}/{name}"), definition });
        Ok(())
    }

    fn typedef(&mut self) -> Result<(), DefinitionError> {
        let kind = self.kind(0)?;
        let name = self.full_name(self.peek().unwrap_or_default());
        self.name()?;
        let kind = self.array_of(kind)?;
        self.types.insert(name, kind);
        self.expect(";")
    }

    /// An enum is a 32-bit number on the wire.
    fn enumeration(&mut self) -> Result<(), DefinitionError> {
        let name = self.name()?;
        self.types.insert(self.full_name(name), (Base::Primitive(Primitive::Uint32), Shape::Scalar));
        self.through_semicolon()
    }

    fn through_semicolon(&mut self) -> Result<(), DefinitionError> {
        while self.next()? != ";" {}
        Ok(())
    }

    fn full_name(&self, name: &str) -> String {
        self.modules.iter().copied().chain([name]).collect::<Vec<_>>().join("::")
    }

    /// What stands behind a name: `[3]`, or nothing.
    fn array_of(&mut self, (base, shape): Kind) -> Result<Kind, DefinitionError> {
        if !self.skip("[") {
            return Ok((base, shape));
        }
        let len = self.size()?;
        self.expect("]")?;
        if shape != Shape::Scalar || self.peek() == Some("[") {
            return Err(self.error("arrays of arrays are not read"));
        }
        Ok((base, Shape::Array(len)))
    }

    fn size(&mut self) -> Result<usize, DefinitionError> {
        let text = self.next()?;
        match text.parse() {
            Ok(size) if size > 0 => Ok(size),
            _ => Err(self.error(format!("`{text}` is no positive size"))),
        }
    }

    fn kind(&mut self, depth: usize) -> Result<Kind, DefinitionError> {
        if depth > MAX_DEPTH {
            return Err(self.error(format!("types are nested deeper than {MAX_DEPTH}")));
        }
        let word = self.next()?;
        let primitive = match word {
            "sequence" => return self.sequence(depth),
            "string" => Primitive::String { bound: self.bound()? },
            "wstring" => Primitive::WString { bound: self.bound()? },
            "unsigned" | "short" | "long" => return self.integer(word),
            "boolean" => Primitive::Bool,
            "octet" => Primitive::Byte,
            "char" => Primitive::Char,
            "wchar" => Primitive::Uint16,
            "float" => Primitive::Float32,
            "double" => Primitive::Float64,
            "int8" => Primitive::Int8,
            "uint8" => Primitive::Uint8,
            "int16" => Primitive::Int16,
            "uint16" => Primitive::Uint16,
            "int32" => Primitive::Int32,
            "uint32" => Primitive::Uint32,
            "int64" => Primitive::Int64,
            "uint64" => Primitive::Uint64,
            _ => {
                self.at -= 1;
                return self.named_kind();
            }
        };
        Ok((Base::Primitive(primitive), Shape::Scalar))
    }

    fn integer(&mut self, first: &str) -> Result<Kind, DefinitionError> {
        let unsigned = first == "unsigned";
        let size = if unsigned { self.next()? } else { first };
        let primitive = match (size, unsigned) {
            ("short", false) => Primitive::Int16,
            ("short", true) => Primitive::Uint16,
            ("long", _) if self.skip("long") => {
                if unsigned {
                    Primitive::Uint64
                } else {
                    Primitive::Int64
                }
            }
            ("long", false) if self.peek() == Some("double") => {
                return Err(self.error("`long double` is not read"));
            }
            ("long", false) => Primitive::Int32,
            ("long", true) => Primitive::Uint32,
            (other, _) => return Err(self.error(format!("`unsigned {other}` is not a type"))),
        };
        Ok((Base::Primitive(primitive), Shape::Scalar))
    }

    fn sequence(&mut self, depth: usize) -> Result<Kind, DefinitionError> {
        self.expect("<")?;
        let (base, shape) = self.kind(depth + 1)?;
        if shape != Shape::Scalar {
            return Err(self.error("sequences of sequences or arrays are not read"));
        }
        let shape = if self.skip(",") { Shape::Bounded(self.size()?) } else { Shape::Unbounded };
        self.expect(">")?;
        Ok((base, shape))
    }

    fn bound(&mut self) -> Result<Option<usize>, DefinitionError> {
        if !self.skip("<") {
            return Ok(None);
        }
        let bound = self.size()?;
        self.expect(">")?;
        Ok(Some(bound))
    }

    /// A type by its name: a typedef or an enum of one of the modules around, or else a struct.
    fn named_kind(&mut self) -> Result<Kind, DefinitionError> {
        self.skip("::");
        let mut parts = vec![self.name()?];
        while self.skip("::") {
            parts.push(self.name()?);
        }
        let name = parts.join("::");
        for around in (0..=self.modules.len()).rev() {
            let full: Vec<&str> = self.modules[..around].iter().copied().chain([name.as_str()]).collect();
            if let Some(kind) = self.types.get(&full.join("::")) {
                return Ok(kind.clone());
            }
        }
        let own = self.modules.first().copied().unwrap_or_default();
        let (package, name) = match parts[..] {
            [.., name] if parts.len() > 1 => (parts[0], name),
            _ => (own, parts[0]),
        };
        Ok((Base::Nested { package: package.to_owned(), name: name.to_owned() }, Shape::Scalar))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "\
// generated from rosidl
#include \"std_msgs/msg/Header.idl\"
module my_pkg {
  module msg {
    module Point_Constants { const int32 LIMIT = -5; const string NAME = \"a; } b\"; };
    typedef double double__3[3];
    enum Colour { RED, GREEN };
    @verbatim (language=\"comment\", text=\"(braces) } and; signs\")
    struct Point {
      std_msgs::msg::Header header;
      double__3 position;
      @unit (value=\"m\") sequence<octet, 4> z;
      sequence<my_pkg::msg::Point2> others;
      unsigned long long a, b[2];
      string<8> name; /* a
      comment */ wstring wide;
      Colour colour;
    };
    struct Empty { uint8 structure_needs_at_least_one_member; };
  };
};
";

    #[test]
    fn structs_with_every_kind_of_member() {
        let all = definitions(TEXT, 1).unwrap();
        assert_eq!(all.iter().map(|named| named.name.as_str()).collect::<Vec<_>>(), ["my_pkg/Point", "my_pkg/Empty"]);
        let fields: Vec<_> = all[0].definition.fields.iter().map(|f| (f.name.as_str(), &f.base, f.shape)).collect();
        let nested = |package: &str, name: &str| Base::Nested { package: package.to_owned(), name: name.to_owned() };
        let primitive = Base::Primitive;
        assert_eq!(
            fields,
            [
                ("header", &nested("std_msgs", "Header"), Shape::Scalar),
                ("position", &primitive(Primitive::Float64), Shape::Array(3)),
                ("z", &primitive(Primitive::Byte), Shape::Bounded(4)),
                ("others", &nested("my_pkg", "Point2"), Shape::Unbounded),
                ("a", &primitive(Primitive::Uint64), Shape::Scalar),
                ("b", &primitive(Primitive::Uint64), Shape::Array(2)),
                ("name", &primitive(Primitive::String { bound: Some(8) }), Shape::Scalar),
                ("wide", &primitive(Primitive::WString { bound: None }), Shape::Scalar),
                ("colour", &primitive(Primitive::Uint32), Shape::Scalar),
            ]
        );
        assert_eq!(all[0].definition.fields[7].line, 16);
    }

    #[test]
    fn faults_name_their_line() {
        for (text, line, reason) in [
            ("module a {", 1, "the IDL ends early"),
            ("struct A {\n  long double x; };", 2, "`long double` is not read"),
            ("\nunion U switch (long) {};", 2, "`union` is not read"),
            ("struct A { sequence<long, 0> x; };", 1, "`0` is no positive size"),
            ("struct A { long 5; };", 1, "a name expected, found `5`"),
            ("struct A : B { };", 1, "structs that extend others"),
        ] {
            let error = definitions(text, 1).unwrap_err();
            assert!(error.line == line && error.reason.contains(reason), "{error} for {text}");
        }
        let tower = "sequence<".repeat(10_000);
        assert!(definitions(&format!("struct A {{ {tower} x; }};"), 1).is_err());
    }
}
