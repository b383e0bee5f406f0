//! The fields of a logged message.

/// A type of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Signed(usize),
    Unsigned(usize),
    Float,
    Double,
}

impl Number {
    pub(super) fn of(name: &str) -> Option<Self> {
        Some(match name {
            "int8_t" => Self::Signed(1),
            "int16_t" => Self::Signed(2),
            "int32_t" => Self::Signed(4),
            "int64_t" => Self::Signed(8),
            "uint8_t" | "bool" | "char" => Self::Unsigned(1),
            "uint16_t" => Self::Unsigned(2),
            "uint32_t" => Self::Unsigned(4),
            "uint64_t" => Self::Unsigned(8),
            "float" => Self::Float,
            "double" => Self::Double,
            _ => return None,
        })
    }

    pub(super) fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) => size,
            Self::Float => 4,
            Self::Double => 8,
        }
    }
}

/// The numeric fields of a topic: name, type, byte offset, and number of elements.
pub(super) type Fields = Vec<(String, Number, usize, usize)>;

/// A topic that is logged.
#[derive(Debug, Clone)]
pub(super) struct Subscription {
    pub(super) topic: String,
    pub(super) instance: u8,
    pub(super) fields: Fields,
    pub(super) wanted: bool,
}

/// The fields of one message.
pub(super) struct Row<'a> {
    pub(super) subscription: &'a Subscription,
    pub(super) bytes: &'a [u8],
}

impl Row<'_> {
    /// Bytes of an element of a field, with its type.
    fn element(&self, name: &str, index: usize) -> Option<(Number, [u8; 8])> {
        let fields = &self.subscription.fields;
        let (_, number, at, count) = fields.iter().find(|(field, ..)| field == name)?;
        let start = (index < *count).then(|| at + index * number.size())?;
        let bytes = self.bytes.get(start..start + number.size())?;
        let mut out = [0; 8];
        out[..bytes.len()].copy_from_slice(bytes);
        Some((*number, out))
    }

    /// A number; `None` if the topic has no such field.
    pub(super) fn number(&self, name: &str, index: usize) -> Option<f64> {
        let (number, bytes) = self.element(name, index)?;
        let [b0, b1, b2, b3, ..] = bytes;
        Some(match number {
            Number::Float => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
            Number::Double => f64::from_le_bytes(bytes),
            _ => self.integer(name, index)? as f64,
        })
    }

    /// A whole number; `None` if the topic has no such field, or it is no integer.
    pub(super) fn integer(&self, name: &str, index: usize) -> Option<i64> {
        let (number, bytes) = self.element(name, index)?;
        let value = i64::from_le_bytes(bytes);
        match number {
            Number::Signed(size) => {
                let unused = 64 - 8 * size as u32;
                Some(value << unused >> unused)
            }
            Number::Unsigned(_) => Some(value),
            Number::Float | Number::Double => None,
        }
    }

    /// Three numbers.
    pub(super) fn three(&self, name: &str) -> Option<[f64; 3]> {
        Some([
            self.number(name, 0)?,
            self.number(name, 1)?,
            self.number(name, 2)?,
        ])
    }
}
