//! Tables of named columns as CSV and Parquet, written in portions.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use parquet::basic::Compression;
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

/// Rows that are held before they are written.
const PORTION: usize = 65_536;

/// What a column holds; any value may be absent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers.
    Int,
    /// Numbers.
    Float,
    /// Texts.
    Text,
    /// True or false.
    Bool,
}

/// A value of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Absent.
    None,
    /// A whole number.
    Int(i64),
    /// A number.
    Float(f64),
    /// A text.
    Text(String),
    /// True or false.
    Bool(bool),
}

impl From<u64> for Value {
    fn from(number: u64) -> Self {
        // Ticks and numbers of strips stay far below 2^63.
        Self::Int(number.cast_signed())
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Float(number)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl<T: Into<Self>> From<Option<T>> for Value {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, Into::into)
    }
}

/// A table on its way into `NAME.csv`, `NAME.parquet`, or both.
pub struct Table {
    columns: &'static [(&'static str, Kind)],
    rows: Vec<Vec<Value>>,
    csv: Option<BufWriter<File>>,
    parquet: Option<SerializedFileWriter<File>>,
}

impl Table {
    /// Starts the table's files.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn create(
        folder: &Path,
        name: &str,
        columns: &'static [(&'static str, Kind)],
        (csv, parquet): (bool, bool),
    ) -> Result<Self> {
        let file = |extension: &str| {
            let path = folder.join(format!("{name}.{extension}"));
            File::create(&path).with_context(|| format!("cannot write {}", path.display()))
        };
        let mut table = Self { columns, rows: Vec::new(), csv: None, parquet: None };
        if csv {
            let mut out = BufWriter::new(file("csv")?);
            let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
            writeln!(out, "{}", names.join(","))?;
            table.csv = Some(out);
        }
        if parquet {
            let schema = Arc::new(parse_message_type(&schema(name, columns))?);
            let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
            table.parquet = Some(SerializedFileWriter::new(file("parquet")?, schema, Arc::new(properties))?);
        }
        Ok(table)
    }

    /// Adds a row.
    ///
    /// # Errors
    /// When the row is not as wide as the table, or a portion cannot be written.
    pub fn push(&mut self, row: Vec<Value>) -> Result<()> {
        ensure!(row.len() == self.columns.len(), "a row of {} values for {} columns", row.len(), self.columns.len());
        self.rows.push(row);
        if self.rows.len() >= PORTION { self.write_portion() } else { Ok(()) }
    }

    /// Writes what is left and ends the files.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn finish(mut self) -> Result<()> {
        self.write_portion()?;
        if let Some(mut csv) = self.csv {
            csv.flush()?;
        }
        if let Some(parquet) = self.parquet {
            parquet.close()?;
        }
        Ok(())
    }

    fn write_portion(&mut self) -> Result<()> {
        let rows = std::mem::take(&mut self.rows);
        if rows.is_empty() {
            return Ok(());
        }
        if let Some(csv) = &mut self.csv {
            for row in &rows {
                let words: Vec<String> = row.iter().map(word).collect();
                writeln!(csv, "{}", words.join(","))?;
            }
        }
        if let Some(parquet) = &mut self.parquet {
            let mut group = parquet.next_row_group()?;
            for (column, (_, kind)) in self.columns.iter().enumerate() {
                let values = rows.iter().map(|row| &row[column]);
                match kind {
                    Kind::Int => write_column::<Int64Type>(&mut group, values, |value| match value {
                        Value::Int(number) => Some(*number),
                        _ => None,
                    })?,
                    Kind::Float => write_column::<DoubleType>(&mut group, values, |value| match value {
                        Value::Float(number) => Some(*number),
                        _ => None,
                    })?,
                    Kind::Text => write_column::<ByteArrayType>(&mut group, values, |value| match value {
                        Value::Text(text) => Some(ByteArray::from(text.as_str())),
                        _ => None,
                    })?,
                    Kind::Bool => write_column::<BoolType>(&mut group, values, |value| match value {
                        Value::Bool(value) => Some(*value),
                        _ => None,
                    })?,
                }
            }
            group.close()?;
        }
        Ok(())
    }
}

fn write_column<'a, T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, File>,
    values: impl Iterator<Item = &'a Value>,
    typed: impl Fn(&Value) -> Option<T::T>,
) -> Result<()> {
    let values: Vec<Option<T::T>> = values.map(typed).collect();
    let present: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = values.into_iter().flatten().collect();
    let mut column = group.next_column()?.context("the table has more columns than its schema")?;
    column.typed::<T>().write_batch(&values, Some(&present), None)?;
    Ok(column.close()?)
}

fn schema(name: &str, columns: &[(&str, Kind)]) -> String {
    let field = |(name, kind): &(&str, Kind)| match kind {
        Kind::Int => format!("OPTIONAL INT64 {name};"),
        Kind::Float => format!("OPTIONAL DOUBLE {name};"),
        Kind::Text => format!("OPTIONAL BYTE_ARRAY {name} (UTF8);"),
        Kind::Bool => format!("OPTIONAL BOOLEAN {name};"),
    };
    format!("message {name} {{ {} }}", columns.iter().map(field).collect::<String>())
}

/// A value in CSV (RFC 4180); numbers as short as they can be read back exactly.
fn word(value: &Value) -> String {
    match value {
        Value::None => String::new(),
        Value::Int(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::Bool(value) => value.to_string(),
        Value::Text(text) if text.contains([',', '"', '\n', '\r']) => format!("\"{}\"", text.replace('"', "\"\"")),
        Value::Text(text) => text.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_quoted_where_they_must_be() {
        assert_eq!(word(&"a \"b\", c".into()), "\"a \"\"b\"\", c\"");
        assert_eq!(word(&"plain".into()), "plain");
        assert_eq!(word(&Value::from(None::<f64>)), "");
        assert_eq!(word(&0.1.into()), "0.1");
    }
}
