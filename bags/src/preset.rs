//! The presets of rosbag2's MCAP storage.

use clap::ValueEnum;

use crate::file::chunk::Compression;
use crate::writer::BagOptions;

/// Settings under a name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
#[value(rename_all = "snake_case")]
pub(crate) enum Preset {
    /// No compression.
    None,
    /// No compression; chunks stay, so that the bag has an index.
    Fastwrite,
    /// Zstandard at its fastest.
    ZstdFast,
    /// Zstandard at its smallest, in chunks of 4 MiB.
    ZstdSmall,
}

impl Preset {
    /// The preset of a name in a file; none for an empty one.
    pub(crate) fn named(name: &str) -> Result<Option<Self>, String> {
        if name.is_empty() { Ok(None) } else { Self::from_str(name, false).map(Some) }
    }

    pub(crate) fn apply(self, options: &mut BagOptions) {
        match self {
            Self::None | Self::Fastwrite => options.compression = Compression::None,
            Self::ZstdFast => (options.compression, options.zstd_level) = (Compression::Zstd, 1),
            Self::ZstdSmall => {
                (options.compression, options.zstd_level) = (Compression::Zstd, 19);
                options.chunk_bytes = 4 << 20;
            }
        }
    }
}
