//! Whether sessions can be of one unit, in the order of time, by what their recordings hold.

use super::Timeline;
use host_core::error::Error;

/// Clocks that show more than this count from an epoch that lasts: Unix time, GPS time. Others
/// count from power-on or from the week, and say nothing of the order. s.
const FROM_AN_EPOCH_S: f64 = 1e8;
/// Sample rates of a unit agree to this share.
const SAME_RATE: f64 = 0.01;

/// What is compared of a session.
#[derive(Debug, Clone)]
pub(super) struct Span {
    name: String,
    rate_hz: f64,
    begin_s: f64,
    end_s: f64,
}

impl Span {
    pub fn of(timeline: &Timeline) -> Self {
        Self {
            name: timeline.name.clone(),
            rate_hz: 1.0 / timeline.session.dt,
            begin_s: timeline.begin_s,
            end_s: timeline.begin_s + timeline.duration_s(),
        }
    }

    /// Checks that this session can come after `before`.
    ///
    /// # Errors
    /// It has another sample rate, or it begins before the other one ends.
    pub fn follows(&self, before: &Self) -> Result<(), Error> {
        let refused = |problem: String, remedy: &str| Error::Option {
            option: self.name.clone(),
            problem,
            remedy: remedy.into(),
        };
        if (self.rate_hz / before.rate_hz - 1.0).abs() > SAME_RATE {
            let problem = format!(
                "has {:.0} samples a second, and '{}' before it {:.0}: it is of another unit, or of \
                 another setting of its sensor",
                self.rate_hz, before.name, before.rate_hz
            );
            let remedy = "give only sessions of one unit with one setting";
            return Err(refused(problem, remedy));
        }
        let ordered = self.begin_s.min(before.begin_s) > FROM_AN_EPOCH_S;
        if ordered && self.begin_s < before.end_s {
            let problem = format!(
                "begins at {:.0} s, and '{}' before it ends at {:.0} s of the same clock",
                self.begin_s, before.name, before.end_s
            );
            let remedy = "put the sessions into the order of time, each of them once";
            return Err(refused(problem, remedy));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(rate_hz: f64, begin_s: f64) -> Span {
        Span {
            name: format!("{begin_s}"),
            rate_hz,
            begin_s,
            end_s: begin_s + 100.0,
        }
    }

    #[test]
    fn another_rate_and_an_earlier_time_are_refused() {
        let said = |now: Span, before: Span| now.follows(&before).map_err(|of| of.to_string());
        assert_eq!(said(span(120.3, 0.0), span(120.0, 0.0)), Ok(()));
        let other = said(span(286.0, 5.0), span(120.0, 0.0)).unwrap_err();
        assert!(
            other.starts_with("5: has 286 samples a second, and '0' before it 120"),
            "{other}"
        );
        // seconds since power-on or of the week say nothing of the order
        assert_eq!(said(span(120.0, 50.0), span(120.0, 400_000.0)), Ok(()));
        let unix = 1.7e9;
        assert_eq!(said(span(120.0, unix + 100.0), span(120.0, unix)), Ok(()));
        let early = said(span(120.0, unix), span(120.0, unix + 50.0)).unwrap_err();
        assert!(early.contains("order of time"), "{early}");
        assert!(said(span(120.0, unix), span(120.0, unix)).is_err());
    }
}
