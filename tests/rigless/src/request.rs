//! The input of a run, from standard input. Times are in ns, bytes are hexadecimal.
use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;

/// A run.
#[derive(Debug, Deserialize)]
pub struct RunRequest {
    /// The image, an ELF file.
    pub image: PathBuf,
    /// The chip.
    pub chip: Chip,
    /// Hz of the crystal at the fast oscillator's pins; 0: there is none.
    pub crystal: u64,
    /// Instructions a second.
    pub instructions: u64,
    /// End of the run.
    pub until: u64,
    /// Received bytes: name of the UART, and for each burst when its first start bit begins, the
    /// bit rate and the bytes.
    #[serde(default)]
    pub lines: BTreeMap<String, Vec<(u64, u64, String)>>,
    /// Conversations: name of the UART, and what its other end asks.
    #[serde(default)]
    pub conversations: BTreeMap<String, Conversation>,
    /// UARTs whose output is printed.
    #[serde(default)]
    pub listen: Vec<String>,
    /// When the reset pin is pulled.
    #[serde(default)]
    pub resets: Vec<u64>,
    /// Registers that are overwritten to inject a fault: when, address and value.
    #[serde(default)]
    pub writes: Vec<(u64, u64, u64)>,
    /// Content of the flash beside the image: address and bytes.
    #[serde(default)]
    pub flash: Vec<(u64, String)>,
    /// Memory that is printed at the end: address and length in bytes.
    #[serde(default)]
    pub memory: Vec<(u64, u64)>,
    /// Registers whose accesses by the core are printed: first address and length in bytes.
    #[serde(default)]
    pub trace: Vec<(u64, u64)>,
    /// A sensor at SPI1.
    pub adis: Option<Adis>,
}

/// Packets of which each is sent when the one before has been answered.
#[derive(Debug, Deserialize)]
pub struct Conversation {
    /// When the first start bit begins.
    pub from: u64,
    /// The bit rate.
    pub baud: u64,
    /// The packets. An answer ends with a zero.
    pub packets: Vec<String>,
    /// From the last answer to the end of the run, unless that is earlier.
    pub rest: u64,
}

/// A chip of rigless.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "lowercase")]
pub enum Chip {
    /// STM32F427.
    F427,
    /// STM32H743.
    H743,
}

/// A sensor.
#[derive(Debug, Deserialize)]
pub struct Adis {
    /// Its product number.
    pub product: u16,
    /// Its range register.
    pub range: u16,
    /// Its fastest clock of a burst, Hz.
    pub hz: u64,
    /// Port, such as `GPIOD`, and pin of the chip select.
    pub select: (String, u8),
    /// Port and pin of data-ready.
    pub ready: (String, u8),
    /// Its bursts, and when each is ready.
    pub bursts: Vec<(u64, String)>,
}

/// Bytes of hexadecimal digits.
pub fn bytes(text: &str) -> anyhow::Result<Vec<u8>> {
    let pairs = (0..text.len() / 2).map(|n| u8::from_str_radix(&text[2 * n..2 * n + 2], 16));
    Ok(pairs.collect::<Result<_, _>>()?)
}

/// Hexadecimal digits of bytes.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
