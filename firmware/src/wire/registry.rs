//! The list of IMU formats turns into an enum, and calls of its members into calls of the formats.

/// Calls a function of a format, with the layout of its frames where it has one.
macro_rules! of_format {
    ($module:ident::$function:ident($($argument:expr),*)) => {
        <$module::Protocol as ImuProtocol>::$function($($argument),*)
    };
    ($module:ident::$function:ident($($argument:expr),*), $layout:ident) => {
        <$module::Protocol as LaidOut>::$function($layout, $($argument),*)
    };
}

/// One row a format: its name in [`super::ImuFormat`] and its module, which has a `Protocol`. A
/// format whose frames do not state their content ([`super::protocol::LaidOut`]) also names the
/// field of its settings that does, and the type of this field.
macro_rules! imu_formats {
    ($($(#[$doc:meta])* $format:ident $(($layout:ident: $Layout:ty))?: $module:ident,)+) => {
        /// The formats of IMUs that come as a stream of bytes.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum ImuFormat {
            $($(#[$doc])* $format $(($Layout))?,)+
        }

        /// Settings that the frames of a sensor do not contain, for every format.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Settings {
            /// Sample rate where the stream does not contain it, Hz, > 0.
            pub rate: f64,
            /// The sensor is an ADIS at an SPI; then its format has no meaning.
            pub adis: Option<adis::Settings>,
            $(#[doc = concat!("What [`", stringify!($module), "`] frames do not contain.")]
            pub $module: <$module::Protocol as ImuProtocol>::Settings,)+
        }

        impl Settings {
            /// Sensors as delivered, at 1000 Hz.
            pub const DEFAULT: Settings = Settings {
                rate: 1000.0,
                adis: None,
                $($module: <$module::Protocol as ImuProtocol>::DEFAULT,)+
            };
        }

        /// A format with the settings that its frames do not contain. The order of the formats is
        /// part of the configuration record: new ones go to the end.
        #[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
        pub enum FormatSettings {
            $($(#[$doc])* $format(<$module::Protocol as ImuProtocol>::Settings),)+
        }

        impl FormatSettings {
            /// The format, with the layout of its frames.
            pub const fn format(self) -> ImuFormat {
                match self {
                    $(FormatSettings::$format(_settings) => {
                        ImuFormat::$format $((_settings.$layout))?
                    })+
                }
            }

            /// Whether a frame of such a sensor may contain its temperature.
            pub fn has_thermometer(self) -> bool {
                match self {
                    $(FormatSettings::$format(settings) => $module::Protocol::has_thermometer(&settings),)+
                }
            }

            /// Replaces that format's settings.
            pub fn apply(self, settings: &mut Settings) {
                match self {
                    $(FormatSettings::$format(of_format) => settings.$module = of_format,)+
                }
            }
        }

        impl ImuFormat {
            /// This format's own part of the settings.
            pub const fn settings(self, settings: &Settings) -> FormatSettings {
                match self {
                    $(ImuFormat::$format { .. } => FormatSettings::$format(settings.$module),)+
                }
            }

            /// This format with the layout of frames by the settings.
            pub const fn configured(self, settings: &Settings) -> ImuFormat {
                self.settings(settings).format()
            }

            /// All formats, with the usual layout of their frames.
            pub const ALL: [ImuFormat; [$(stringify!($format)),+].len()] =
                [$(ImuFormat::$format $((<$Layout>::USUAL))?),+];

            /// Name of the format: lower case, without spaces.
            pub const fn name(self) -> &'static str {
                match self {
                    $(ImuFormat::$format { .. } => <$module::Protocol as ImuProtocol>::NAME,)+
                }
            }

            /// The format of this name.
            pub fn from_name(name: &str) -> Option<ImuFormat> {
                ImuFormat::ALL.into_iter().find(|format| format.name() == name)
            }

            /// Sensors to simulate, at least one; the first is that of simulated drives.
            pub const fn simulated(self) -> &'static [Simulated] {
                match self {
                    $(ImuFormat::$format { .. } => <$module::Protocol as ImuProtocol>::SIMULATED,)+
                }
            }

            /// Recomputes the checksum of a frame, for simulators and tests.
            pub fn seal(self, frame: &mut [u8]) {
                match self {
                    $(ImuFormat::$format { .. } => $module::Protocol::seal(frame),)+
                }
            }

            #[inline(always)]
            fn content(self, frame: &[u8]) -> u8 {
                match self {
                    $(ImuFormat::$format { .. } => $module::Protocol::content(frame),)+
                }
            }

            fn stream(self, settings: &Settings, content: u8) -> Option<sequence::Stream> {
                let rate = settings.rate;
                match self {
                    $(ImuFormat::$format { .. } => {
                        $module::Protocol::stream(&settings.$module, content, rate)
                    })+
                }
            }

            /// Whether a good message shows that the sensor has just started.
            pub(crate) fn starts_up(self, message: &[u8]) -> bool {
                match self {
                    $(ImuFormat::$format { .. } => $module::Protocol::starts_up(message),)+
                }
            }

            #[inline(always)]
            fn always_changes(self, settings: &Settings) -> bool {
                match self {
                    $(ImuFormat::$format { .. } => {
                        $module::Protocol::always_changes(&settings.$module)
                    })+
                }
            }

            #[inline(always)]
            fn read(self, frame: &[u8]) -> Option<Reading> {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        registry::of_format!($module::read(frame) $(, $layout)?)
                    })+
                }
            }

            #[inline(always)]
            fn change(self, frame: &mut [u8], change: &Change) -> Option<Axes> {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        registry::of_format!(
                            $module::change(frame, change, &change.settings.$module)
                            $(, $layout)?
                        )
                    })+
                }
            }
        }

        impl Framing for ImuFormat {
            #[inline(never)] // one copy, for all finders
            fn scan(self, bytes: &[u8]) -> Scan {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        registry::of_format!($module::scan(bytes) $(, $layout)?)
                    })+
                }
            }

            #[inline(always)]
            fn usual(self, bytes: &[u8]) -> Option<usize> {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        registry::of_format!($module::usual(bytes) $(, $layout)?)
                    })+
                }
            }

            #[inline(always)]
            fn has_start_mark(self) -> bool {
                match self {
                    $(ImuFormat::$format { .. } => {
                        <$module::Protocol as ImuProtocol>::HAS_START_MARK
                    })+
                }
            }
        }

        /// Examples that only a format itself can give its tests.
        #[cfg(test)]
        impl examples::Examples for ImuFormat {
            fn example(self, n: u8) -> std::vec::Vec<u8> {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        $module::tests::example(n $(, $layout)?)
                    })+
                }
            }

            fn remade(self, frame: &[u8]) -> Result<std::vec::Vec<u8>, Error> {
                match self {
                    $(ImuFormat::$format $(($layout))? => {
                        $module::tests::remade(frame $(, $layout)?)
                    })+
                }
            }
        }
    };
}

pub(super) use {imu_formats, of_format};
