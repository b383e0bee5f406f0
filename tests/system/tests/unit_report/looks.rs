//! Reads the page and its print with independent programs.

use serde_json::Value;
use std::path::Path;
use std::process::Command;
use system::well_formed;

/// A text with uniform hyphens, minus signs and spaces.
fn flat(text: &str) -> String {
    text.replace(['\u{2011}', '\u{2212}'], "-")
        .replace('\u{a0}', " ")
}

/// Whether the browser that prints is installed; where it is required, it must be.
pub fn can_print() -> bool {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let starts = |name: &&str| Command::new(name).arg("--version").output().is_ok();
    let found = names.iter().any(starts);
    assert!(
        found || std::env::var_os("LRNN_REQUIRE_BROWSER").is_none(),
        "Chromium is not installed"
    );
    found
}

/// The text of the PDF as poppler reads it; `None` where that is not installed.
fn pdf_text(file: &Path) -> Option<String> {
    let read = Command::new("pdftotext")
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

/// Checks the page: complete, self-contained, and with the verdict of the JSON.
pub fn looks_right(report: &Value, page: &str) {
    well_formed(page).unwrap();
    let outside = ["<link", "<img", " src=", "@import", "url(http", "fetch("];
    assert!(outside.iter().all(|what| !page.contains(what)));
    let addresses =
        page.matches("http").count() - page.matches("http://www.w3.org/2000/svg").count();
    assert_eq!(addresses, 0, "only the name space of SVG is an address");
    let verdict = report["verdict"].as_array().unwrap();
    assert!(verdict[0].as_str().unwrap().starts_with("Verdict: "));
    let page = flat(page);
    for sentence in verdict {
        let sentence = flat(sentence.as_str().unwrap()).replace('"', "&quot;");
        assert!(page.contains(&sentence), "{sentence}");
    }
}

/// Checks the print: complete, with the verdict and the numbers of the JSON, and tags.
pub fn prints_correctly(report: &Value, pdf: &Path) {
    let bytes = std::fs::read(pdf).unwrap();
    assert!(bytes.starts_with(b"%PDF-") && bytes.trim_ascii_end().ends_with(b"%%EOF"));
    let tagged = bytes.windows(15).any(|part| part == b"/StructTreeRoot");
    assert!(tagged, "for programs that read aloud");
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
    let verdict = &report["verdict"];
    assert!(text.contains(&flat(verdict[0].as_str().unwrap())), "{text}");
    assert!(text.contains("page 1 of"), "numbers of pages");
    for part in report["parts"].as_array().unwrap() {
        let title = part["title"].as_str().unwrap();
        assert!(text.contains(&flat(title)), "{title}");
    }
}
