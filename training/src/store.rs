//! Files of named tensors: safetensors with a header of ours and a digest of everything in them.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use safetensors::SafeTensors;
use safetensors::tensor::{Dtype, View};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::{Result, TrainingError};

/// The key of the safetensors metadata that holds our [`Label`].
const LABEL: &str = "swath";

/// Numbers of one tensor, as the file stores them.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    /// Kind of number.
    pub dtype: Dtype,
    /// Shape.
    pub shape: Vec<usize>,
    /// Little-endian bytes.
    pub bytes: Vec<u8>,
}

/// A file's content: a header as JSON, and tensors by name.
#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// JSON.
    pub header: String,
    /// Tensors.
    pub tensors: BTreeMap<String, Stored>,
}

#[derive(Serialize, Deserialize)]
struct Label {
    sha256: String,
    header: String,
}

impl View for &Stored {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

/// A number that tensors are stored as.
pub trait Number: Copy {
    /// Its kind.
    const DTYPE: Dtype;
    /// Its bytes, little-endian.
    fn put(self, bytes: &mut Vec<u8>);
    /// The inverse of [`Number::put`]; the slice has the number's size.
    fn take(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($kind:ty, $dtype:expr) => {
        impl Number for $kind {
            const DTYPE: Dtype = $dtype;
            fn put(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }
            fn take(bytes: &[u8]) -> Self {
                let mut array = [0; size_of::<$kind>()];
                array.copy_from_slice(bytes);
                <$kind>::from_le_bytes(array)
            }
        }
    };
}
number!(f32, Dtype::F32);
number!(f64, Dtype::F64);
number!(u64, Dtype::U64);
number!(u8, Dtype::U8);

impl Stored {
    /// Numbers in row order.
    pub fn new<N: Number>(shape: &[usize], numbers: &[N]) -> Self {
        let mut bytes = Vec::with_capacity(size_of_val(numbers));
        numbers.iter().for_each(|number| number.put(&mut bytes));
        Self { dtype: N::DTYPE, shape: shape.to_vec(), bytes }
    }

    fn numbers<N: Number>(&self) -> Option<Vec<N>> {
        let chunks = self.bytes.chunks_exact(size_of::<N>());
        (self.dtype == N::DTYPE).then(|| chunks.map(N::take).collect())
    }
}

impl Content {
    /// Adds a tensor.
    pub fn insert<N: Number>(&mut self, name: &str, shape: &[usize], numbers: &[N]) {
        self.tensors.insert(name.to_owned(), Stored::new(shape, numbers));
    }

    /// The numbers of a tensor, whatever its shape.
    ///
    /// # Errors
    /// When it is missing or holds another kind of number; `path` is named.
    pub fn numbers<N: Number>(&self, name: &str, path: &Path) -> Result<Vec<N>> {
        let numbers = self.tensors.get(name).and_then(Stored::numbers);
        numbers.ok_or_else(|| TrainingError::unsuitable(path, format!("it has no {:?} tensor {name}", N::DTYPE)))
    }

    /// The file's bytes; the same content always gives the same bytes.
    ///
    /// # Errors
    /// Tensors whose bytes do not fit their shape.
    pub fn to_bytes(&self) -> Result<Vec<u8>> {
        let label = Label { sha256: self.digest(), header: self.header.clone() };
        let metadata = HashMap::from([(LABEL.to_owned(), json(&label)?)]);
        safetensors::serialize(self.tensors.iter(), Some(metadata))
            .map_err(|error| TrainingError::Environment(error.to_string()))
    }

    /// Reads bytes back.
    ///
    /// # Errors
    /// [`TrainingError::Damaged`] for what [`Content::to_bytes`] wrote and something changed, and
    /// [`TrainingError::Unsuitable`] for what it never wrote; `path` is named.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Self> {
        let damaged = |reason: String| TrainingError::damaged(path, reason);
        let foreign = |reason: &str| TrainingError::unsuitable(path, reason);
        // Eight bytes of length, then JSON: what begins otherwise never was such a file, whatever its length.
        if bytes.get(8).is_some_and(|&byte| byte != b'{') {
            return Err(foreign("it is no policy and no checkpoint"));
        }
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(|error| damaged(error.to_string()))?;
        let label = metadata.metadata().as_ref().and_then(|it| it.get(LABEL));
        let label = label.ok_or_else(|| foreign("it was not written by swath-train"))?;
        let label: Label = serde_json::from_str(label).map_err(|error| damaged(error.to_string()))?;
        let views = SafeTensors::deserialize(bytes).map_err(|error| damaged(error.to_string()))?;
        let tensors = views.iter().map(|(name, view)| {
            let stored = Stored { dtype: view.dtype(), shape: view.shape().to_vec(), bytes: view.data().to_vec() };
            (name.to_owned(), stored)
        });
        let content = Self { header: label.header, tensors: tensors.collect() };
        if content.digest() != label.sha256 {
            return Err(damaged("its digest does not fit its content".into()));
        }
        Ok(content)
    }

    /// Reads a file.
    ///
    /// # Errors
    /// As [`Content::from_bytes`], and when it cannot be read.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = fs::read(path).map_err(TrainingError::file("read", path))?;
        Self::from_bytes(&bytes, path)
    }

    /// SHA-256 over header, names, shapes and numbers, in hexadecimal.
    #[must_use]
    pub fn digest(&self) -> String {
        let mut hasher = Sha256::new();
        let mut part = |bytes: &[u8]| {
            hasher.update((bytes.len() as u64).to_le_bytes());
            hasher.update(bytes);
        };
        part(self.header.as_bytes());
        for (name, tensor) in &self.tensors {
            part(name.as_bytes());
            part(format!("{:?} {:?}", tensor.dtype, tensor.shape).as_bytes());
            part(&tensor.bytes);
        }
        let digest = hasher.finalize();
        digest.iter().map(|byte| format!("{byte:02x}")).collect()
    }
}

/// Replaces a file in one step: whatever goes wrong, the old one stays whole.
///
/// # Errors
/// When the new content cannot be written, such as on a full disk; nothing is left behind then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<()> {
    let partial = path.with_extension("partial");
    let written = File::create(&partial).and_then(|mut file| {
        file.write_all(bytes)?;
        file.sync_all()
    });
    let replaced = written.and_then(|()| fs::rename(&partial, path));
    replaced.map_err(|error| {
        // The write has failed already; that the leftover cannot be removed adds nothing.
        let _ = fs::remove_file(&partial);
        TrainingError::file("write", path)(error)
    })
}

/// JSON text of a value.
///
/// # Errors
/// A value that JSON cannot hold.
pub fn json(value: &impl Serialize) -> Result<String> {
    serde_json::to_string(value).map_err(|error| TrainingError::Environment(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Content {
        let mut content = Content { header: r#"{"a":1}"#.into(), tensors: BTreeMap::new() };
        content.insert("weights", &[2, 2], &[1.0f32, -2.5, 3e-30, 4.0]);
        content.insert("seeds", &[3], &[1u64, u64::MAX, 7]);
        content
    }

    #[test]
    fn what_is_written_is_read_back_exactly() {
        let path = Path::new("sample");
        let bytes = sample().to_bytes().unwrap();
        assert_eq!(bytes, sample().to_bytes().unwrap());
        let content = Content::from_bytes(&bytes, path).unwrap();
        assert_eq!(content, sample());
        let seeds: Vec<u64> = content.numbers("seeds", path).unwrap();
        assert_eq!(seeds, [1, u64::MAX, 7]);
        assert!(content.numbers::<f32>("seeds", path).is_err());
    }

    #[test]
    fn every_cut_and_every_flipped_byte_is_noticed_by_name() {
        let bytes = sample().to_bytes().unwrap();
        for length in 0..bytes.len() {
            let error = Content::from_bytes(&bytes[..length], Path::new("cut")).unwrap_err();
            assert!(error.to_string().contains("cut is damaged"), "{error}");
        }
        for place in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[place] ^= 1;
            let read = Content::from_bytes(&flipped, Path::new("flipped"));
            // A flipped space of the padding changes nothing that is read.
            assert!(read.is_err() || bytes[place] == b' ', "byte {place}");
        }
    }

    #[test]
    fn what_is_no_file_of_ours_is_not_called_damaged() {
        let refused = |bytes: &[u8]| Content::from_bytes(bytes, Path::new("other")).unwrap_err().to_string();
        let text = refused(b"# Swath\n\nSwath flies and operates one super-agile satellite.\n");
        assert_eq!(text, "other cannot be used here: it is no policy and no checkpoint");
        let tensors = [("weights", Stored::new(&[1], &[1.0f32]))];
        let foreign = safetensors::serialize(tensors.iter().map(|(name, it)| (name, it)), None).unwrap();
        assert_eq!(refused(&foreign), "other cannot be used here: it was not written by swath-train");
        let missing = sample().numbers::<f32>("bias", Path::new("other")).unwrap_err().to_string();
        assert_eq!(missing, "other cannot be used here: it has no F32 tensor bias");
    }

    #[test]
    fn a_failed_write_leaves_the_old_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("checkpoint.safetensors");
        write_atomically(&path, b"good").unwrap();
        // A folder where the partial file would go makes the write fail.
        fs::create_dir(folder.path().join("checkpoint.partial")).unwrap();
        let error = write_atomically(&path, b"new").unwrap_err();
        assert!(error.to_string().contains("checkpoint.safetensors"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"good");
    }
}
