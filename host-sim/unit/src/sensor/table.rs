//! Makes the names of the formats and their tables from one list.

/// One row a format: variant, name in the wire registry, key of its table, type of its table.
macro_rules! sensor {
    ($($(#[$doc:meta])* $format:ident $name:literal $field:ident: $section:ty,)+) => {
        /// Format of the sensor's frames.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        pub enum FormatName {
            $($(#[$doc])* #[serde(rename = $name)] $format,)+
            /// Analog Devices ADIS at the board's SPI; the table `adis` names the model
            #[serde(rename = "adis-spi")]
            AdisSpi,
            /// Detected by the device at start, with sensors as delivered
            #[serde(rename = "detect")]
            Detect,
        }

        impl FormatName {
            /// All names.
            pub const ALL: &[Self] = &[$(Self::$format,)+ Self::AdisSpi, Self::Detect];

            /// Its name in files.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$format => $name,)+
                    Self::AdisSpi => "adis-spi",
                    Self::Detect => "detect",
                }
            }
        }

        /// The sensor: the format of its frames, settings that they do not contain, and its line.
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(deny_unknown_fields)]
        pub struct Sensor {
            /// Format of the frames. Required. Source: the sensor's manual.
            pub format: FormatName,
            /// Samples a second, Hz, 1 to 20000. Default: as the sensor is delivered. Source: how
            /// the sensor is set up. An ADIS at the SPI is set to it by the board: 2000 Hz (1649x:
            /// 4250) divided by a whole number; default 1000 (1062.5).
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schemars(range(min = 1, max = 20_000))]
            pub rate_hz: Option<f64>,
            /// Bit rate of the sensor's and the navigation computer's line, bit/s, 1200 to
            /// 12000000. Default: 921600. Source: how the sensor is set up.
            #[serde(default = "baud")]
            #[schemars(range(min = 1_200, max = 12_000_000))]
            pub baud: u32,
            /// Parity of both lines. Default: none. Source: the sensor's manual.
            #[serde(default)]
            pub parity: Parity,
            /// Stop bits of both lines, 1 or 2. Default: 1. Source: the sensor's manual.
            #[serde(default = "one")]
            #[schemars(range(min = 1, max = 2))]
            pub stop_bits: u8,
            /// Which of the board's sets of pins the lines use. Default: 0, the board's usual one.
            /// Source: docs/wiring.md.
            #[serde(default)]
            #[schemars(range(min = 0, max = 255))]
            pub pins: u8,
            /// Cut-through: bytes leave while the frame is still arriving, two or three bytes after
            /// they arrived. STIM300, KVH and NovAtel only. Default: false. Source: whether the
            /// navigation computer needs the frames sooner.
            #[serde(default)]
            pub cut_through: bool,
            /// The sensor counts as silent when no byte has come for this time, ms, 1 to 10000.
            /// Default: 100. Source: several times the time between two frames.
            #[serde(default = "silence")]
            #[schemars(range(min = 1, max = 10_000))]
            pub silence_ms: f64,
            $(
                $(#[$doc])*
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub $field: Option<$section>,
            )+
            /// Analog Devices ADIS at the board's SPI
            #[serde(default, skip_serializing_if = "Option::is_none")]
            pub adis: Option<Adis>,
        }

        impl Sensor {
            /// A sensor of this format with the default of everything else.
            #[must_use]
            pub fn of(format: FormatName) -> Self {
                Self {
                    format,
                    rate_hz: None,
                    baud: baud(),
                    parity: Parity::default(),
                    stop_bits: one(),
                    pins: 0,
                    cut_through: false,
                    silence_ms: silence(),
                    $($field: None,)+
                    adis: None,
                }
            }

            /// The sensor at a serial line of a device's configuration.
            #[allow(unreachable_patterns, reason = "a format that has no row yet")]
            pub(crate) fn of_stream(format: FormatSettings) -> Self {
                let mut settings = Settings::DEFAULT;
                format.apply(&mut settings);
                match format {
                    $(FormatSettings::$format(_) => Self {
                        $field: Some(<$section>::of(&settings)),
                        ..Self::of(FormatName::$format)
                    },)+
                    _ => Self::of(FormatName::Detect),
                }
            }

            /// Settings that the frames do not contain: the format's table, or its defaults.
            fn section(&self) -> Box<dyn Section> {
                match self.format {
                    $(FormatName::$format => Box::new(self.$field.clone().unwrap_or_default()),)+
                    FormatName::AdisSpi | FormatName::Detect => Box::new(Plain {}),
                }
            }

            /// Keys of the tables that are given, with the format that each belongs to.
            pub(crate) fn tables(&self) -> Vec<(&'static str, FormatName)> {
                let mut given = Vec::new();
                $(
                    if self.$field.is_some() {
                        given.push((stringify!($field), FormatName::$format));
                    }
                )+
                if self.adis.is_some() {
                    given.push(("adis", FormatName::AdisSpi));
                }
                given
            }
        }
    };
}
pub(super) use sensor;
