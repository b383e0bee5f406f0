//! Items that can be stored in a file.

use firmware::sample::Counts;

/// An item of a list. All items of one list have the same number of bytes.
pub trait Item: Clone {
    /// Adds its bytes.
    fn put(&self, bytes: &mut Vec<u8>);

    /// The item that these bytes were made of.
    fn take(bytes: &[u8]) -> Self;
}

/// Adds numbers.
pub(crate) fn put_all(bytes: &mut Vec<u8>, numbers: &[f64]) {
    numbers.iter().for_each(|x| x.put(bytes));
}

/// The numbers that bytes were made of.
pub(crate) fn numbers(bytes: &[u8]) -> impl Iterator<Item = f64> {
    let (eights, _) = bytes.as_chunks();
    eights.iter().map(|b| f64::from_ne_bytes(*b))
}

impl Item for f64 {
    fn put(&self, bytes: &mut Vec<u8>) {
        bytes.extend_from_slice(&self.to_ne_bytes());
    }

    fn take(bytes: &[u8]) -> Self {
        numbers(bytes).next().unwrap_or_default()
    }
}

impl Item for Counts {
    fn put(&self, bytes: &mut Vec<u8>) {
        let all = self.dtheta.iter().chain(&self.dv);
        all.for_each(|count| bytes.extend_from_slice(&count.to_ne_bytes()));
    }

    fn take(bytes: &[u8]) -> Self {
        let (fours, _) = bytes.as_chunks();
        let mut counts = fours.iter().map(|b| i32::from_ne_bytes(*b));
        let mut next = || [0; 3].map(|_: i32| counts.next().unwrap_or_default());
        Self {
            dtheta: next(),
            dv: next(),
        }
    }
}
