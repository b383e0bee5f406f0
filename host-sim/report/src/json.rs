//! The results as JSON: a stable format for scripts, without NaN.

use super::{allan, verdict};
use host_core::error::Error;
use host_estimation::analysis::allan::findings::Findings;
use host_lab::experiment::outcome::Outcome;
use host_lab::experiment::results::Results;
use serde::Serialize;

/// The results as JSON text with a final line break.
///
/// Its form is `{"schema","scenario","seed","rows":[..],"verdict"}`, each row
/// `{"t_s","scheme","d_north_m","d_east_m", "d_vn_mps","d_ve_mps","horizontal_m"}`.
///
/// # Errors
/// [`Error::BadResult`] naming row and field of a number that JSON cannot hold (NaN, infinity).
pub fn json(results: &Results) -> Result<String, Error> {
    check(results)?;
    let failed = |error: serde_json::Error| Error::BadResult {
        item: results.scenario.clone(),
        field: "rows",
        problem: error.to_string(),
    };
    let said = WithVerdict::of(results, &verdict::of_results(results));
    Ok(serde_json::to_string_pretty(&said).map_err(failed)? + "\n")
}

/// Results with the sentence of their verdict.
#[derive(Debug, Serialize)]
pub struct WithVerdict<'a, T: Serialize> {
    #[serde(flatten)]
    results: &'a T,
    verdict: String,
}

impl<'a, T: Serialize> WithVerdict<'a, T> {
    /// `said`: the verdict, the sentence first.
    pub fn of(results: &'a T, said: &[String]) -> Self {
        Self {
            results,
            verdict: said.first().cloned().unwrap_or_default(),
        }
    }
}

/// The cases of a replay, each with its verdict.
#[must_use]
pub fn outcomes(all: &[Outcome]) -> Vec<WithVerdict<'_, Outcome>> {
    let said = |of| WithVerdict::of(of, &verdict::of_outcome(of));
    all.iter().map(said).collect()
}

/// Noise at rest with its verdict.
///
/// # Errors
/// [`Error::BadResult`] for a number that JSON cannot hold.
pub fn findings(of: &Findings) -> Result<String, Error> {
    of.json()?; // rejects results that are not finite
    let said = WithVerdict::of(of, &[allan::verdict(of)]);
    let text = serde_json::to_string_pretty(&said);
    Ok(text.unwrap_or_default() + "\n")
}

/// Rejects a result that is NaN or infinite.
///
/// # Errors
/// [`Error::BadResult`] naming row and field.
pub(super) fn check(results: &Results) -> Result<(), Error> {
    for (number, row) in results.rows.iter().enumerate() {
        let fields = [
            ("d_north_m", row.d_north_m),
            ("d_east_m", row.d_east_m),
            ("d_vn_mps", row.d_vn_mps),
            ("d_ve_mps", row.d_ve_mps),
            ("horizontal_m", row.horizontal_m),
        ];
        if let Some((field, value)) = fields.into_iter().find(|(_, value)| !value.is_finite()) {
            let item = format!("row {} ({} min, {})", number + 1, row.t_s / 60, row.scheme);
            return Err(Error::BadResult {
                item,
                field,
                problem: format!("is {value}"),
            });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_lab::experiment::results::Row;

    fn results() -> Results {
        let row = Row {
            t_s: 300,
            scheme: "raw".into(),
            d_north_m: 181.25,
            d_east_m: -931.81,
            d_vn_mps: -5.0,
            d_ve_mps: -2.31,
            horizontal_m: 949.273,
        };
        Results {
            schema: 3,
            scenario: "paper".into(),
            seed: 7,
            rows: vec![row],
            device: None,
        }
    }

    #[test]
    fn the_format_stays_as_it_is() {
        let expected = r#"{"schema":3,"scenario":"paper","seed":7,"rows":[{"t_s":300,"scheme":"raw","d_north_m":181.25,"d_east_m":-931.81,"d_vn_mps":-5.0,"d_ve_mps":-2.31,"horizontal_m":949.273}],"verdict":""}"#;
        let text = json(&results()).unwrap();
        assert_eq!(text.split_whitespace().collect::<String>(), expected);
        assert!(text.ends_with("}\n"));
    }

    #[test]
    fn numbers_read_back_exactly() {
        let mut results = results();
        results.rows[0].horizontal_m = 0.1 + 0.2;
        results.seed = u64::MAX;
        let back: serde_json::Value = serde_json::from_str(&json(&results).unwrap()).unwrap();
        assert_eq!(back["rows"][0]["horizontal_m"].as_f64(), Some(0.1 + 0.2));
        assert_eq!(back["seed"].as_u64(), Some(u64::MAX));
    }

    #[test]
    fn nan_and_infinity_are_refused_by_row_and_field() {
        let bad: [fn(&mut Row); 3] = [
            |row| row.d_vn_mps = f64::NAN,
            |row| row.horizontal_m = f64::INFINITY,
            |row| row.d_north_m = f64::NEG_INFINITY,
        ];
        for (spoil, expected) in bad.into_iter().zip([
            "result 'row 1 (5 min, raw)': 'd_vn_mps' is NaN, so nothing was written; remedy: ",
            "result 'row 1 (5 min, raw)': 'horizontal_m' is inf, so",
            "result 'row 1 (5 min, raw)': 'd_north_m' is -inf, so",
        ]) {
            let mut results = results();
            spoil(&mut results.rows[0]);
            let message = json(&results).unwrap_err().to_string();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
