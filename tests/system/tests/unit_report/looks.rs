//! How page and PDF are read, by others than who wrote them.

use serde_json::Value;
use std::path::Path;
use system::well_formed;

/// The text of the PDF as poppler reads it; `None` where that is not installed.
fn pdf_text(file: &Path) -> Option<String> {
    let read = std::process::Command::new("pdftotext")
        .arg("-layout")
        .arg(file)
        .arg("-")
        .output();
    match read {
        Ok(read) => {
            assert!(read.status.success() && read.stderr.is_empty(), "{read:?}");
            Some(String::from_utf8(read.stdout).unwrap())
        }
        Err(_) => {
            println!("skipped: the PDF's text, because pdftotext is missing (poppler-utils)");
            None
        }
    }
}

/// Page and PDF: whole, alone, and with the verdict and the numbers of the JSON.
pub fn looks_right(report: &Value, page: &str, pdf: &Path) {
    well_formed(page).unwrap();
    let outside = ["<link", "<img", " src=", "@import", "url(http", "fetch("];
    assert!(outside.iter().all(|what| !page.contains(what)));
    let addresses =
        page.matches("http").count() - page.matches("http://www.w3.org/2000/svg").count();
    assert_eq!(addresses, 0, "only the name space of SVG is an address");
    let verdict = report["verdict"].as_array().unwrap();
    assert!(verdict[0].as_str().unwrap().starts_with("Verdict: "));
    let flat = |text: &str| {
        text.replace(['\u{2011}', '\u{2212}'], "-")
            .replace('\u{a0}', " ")
    };
    let page = flat(page);
    for sentence in verdict {
        let sentence = flat(sentence.as_str().unwrap()).replace('"', "&quot;");
        assert!(page.contains(&sentence), "{sentence}");
    }
    let bytes = std::fs::read(pdf).unwrap();
    assert!(bytes.starts_with(b"%PDF-1.7") && bytes.trim_ascii_end().ends_with(b"%%EOF"));
    let Some(text) = pdf_text(pdf) else { return };
    let text = flat(&text).split_whitespace().collect::<Vec<_>>().join(" ");
    for row in report["parts"].as_array().unwrap().iter().flat_map(|part| {
        let tables = part["tables"].as_array().unwrap().iter();
        tables
            .flat_map(|table| table["rows"].as_array().unwrap())
            .take(4)
    }) {
        let number = flat(row[row.as_array().unwrap().len() - 1].as_str().unwrap());
        let word = number.split(' ').next().unwrap();
        assert!(word.len() > 60 || text.contains(word), "{number}");
    }
    assert!(text.contains(&flat(verdict[0].as_str().unwrap())), "{text}");
    assert!(text.contains("page 1 of"), "numbers of pages");
    for part in report["parts"].as_array().unwrap() {
        let title = part["title"].as_str().unwrap();
        // among the contents, and above the part
        assert!(text.matches(title).count() >= 2, "{title}");
    }
}
