//! The first screen of every page, as a browser lays it out: the sentence of the verdict, one
//! picture and three figures, on a broad screen and on a telephone.

#![allow(
    clippy::unwrap_used,
    reason = "test helpers; a failure here fails the test"
)]

use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use system::host_sim_binary;

/// Width and height of the screens, CSS pixels.
const SCREENS: [(u32, u32); 2] = [(1280, 800), (390, 844)];
/// What is looked for in a page: lower and upper ends of the parts that are seen, and whether the
/// page is broader than its screen.
const LOOK: &str = "
const seen = (d, what) => [...d.querySelectorAll(what)]
  .map(e => e.getBoundingClientRect()).find(r => r.height > 0) ?? {top: 1e9, bottom: 1e9};
addEventListener('load', () => {
  const all = [...document.querySelectorAll('iframe')].map(f => {
    const d = f.contentDocument, e = d.documentElement;
    const [said, picture, big, other] =
      ['.verdict', 'svg', '.big', 'table, details, nav, pre'].map(what => seen(d, what));
    return {page: f.title, height: f.clientHeight, said: said.bottom, top: picture.top,
      picture: picture.bottom, big: big.bottom, figures: d.querySelectorAll('.big li').length,
      other: other.top, area: (picture.bottom - picture.top) / f.clientHeight,
      broader: e.scrollWidth - e.clientWidth};
  });
  document.getElementById('found').textContent = JSON.stringify(all);
});";

fn host_sim(dir: &Path, args: &str) {
    let done = Command::new(host_sim_binary())
        .current_dir(dir)
        .args(args.split(' '))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{args}: {said}");
}

/// One page of each kind, from short simulations.
fn pages(dir: &Path) -> Vec<PathBuf> {
    let scenario = "unit = \"tactical\"\n[learn]\nstandstill_s = 120\ndrive_s = 500\n[test]\n\
                    standstill_s = 120\ndrive_s = 1320\n";
    std::fs::write(dir.join("s.toml"), scenario).unwrap();
    for seed in 1..=3 {
        host_sim(
            dir,
            &format!("simulate --scenario s.toml --learning --seed {seed} --out d{seed}"),
        );
    }
    host_sim(dir, "run --out run");
    host_sim(dir, "replay csv --header d1/header.toml --out replay");
    host_sim(dir, "report --from d1 --out unit");
    host_sim(dir, "allan --unit tactical --duration 600 --out allan");
    host_sim(
        dir,
        "replay sessions d1/unit.toml d1/header.toml d2/header.toml d3/header.toml --horizons 5,30 \
         --page sessions.html",
    );
    host_sim(
        dir,
        "campaign --runs 6 --models noise --tuning-units 1 --schemes uncorrected,ekf6,device \
         --out c --report campaign.html",
    );
    [
        "run/index.html",
        "replay/index.html",
        "unit/index.html",
        "allan/index.html",
        "sessions.html",
        "campaign.html",
    ]
    .map(|page| dir.join(page))
    .to_vec()
}

/// The browser, or `None` on a machine that has none.
fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let starts = |name: &&str| Command::new(name).arg("--version").output().is_ok();
    let found = names.into_iter().find(starts);
    let required = std::env::var_os("LRNN_REQUIRE_BROWSER").is_some();
    assert!(found.is_some() || !required, "Chromium is not installed");
    found
}

/// Lays all pages out on both screens.
fn laid_out(browser: &str, dir: &Path, pages: &[PathBuf]) -> Vec<Value> {
    let mut frames = String::new();
    for page in pages {
        for (width, height) in SCREENS {
            let file = page.display();
            write!(
                frames,
                "<iframe src=\"file://{file}\" title=\"{file} {width}\" \
                 style=\"border:0;width:{width}px;height:{height}px\"></iframe>"
            )
            .unwrap();
        }
    }
    let all = dir.join("all.html");
    let text = format!("<pre id=found></pre><script>{LOOK}</script>{frames}");
    std::fs::write(&all, text).unwrap();
    let done = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--dump-dom"])
        .args([
            "--no-first-run",
            "--disable-dev-shm-usage",
            "--allow-file-access-from-files",
        ])
        .args(["--hide-scrollbars", "--window-size=1400,900"])
        .arg(format!("--user-data-dir={}", dir.join("profile").display()))
        .arg(format!("file://{}", all.display()))
        .output()
        .unwrap();
    let dom = String::from_utf8_lossy(&done.stdout).into_owned();
    let found = dom.split_once("<pre id=\"found\">").unwrap().1;
    serde_json::from_str(found.split_once("</pre>").unwrap().0).unwrap()
}

#[test]
fn every_page_begins_with_a_sentence_a_picture_and_three_figures() {
    let dir = tempfile::tempdir().unwrap();
    let dir = dir.path().canonicalize().unwrap();
    let pages = pages(&dir);
    for page in &pages {
        let text = std::fs::read_to_string(page).unwrap();
        system::well_formed(&text).unwrap();
        assert_eq!(text.matches("class=\"verdict\">Verdict").count(), 1);
        let shown = text.split("<script").next().unwrap();
        assert!(!shown.contains('`'), "{}: a backtick", page.display());
        assert!(!shown.contains("(s)"), "{}: a plural", page.display());
    }
    let Some(browser) = browser() else {
        return println!("skipped: the layout, because Chromium is missing");
    };
    let found = laid_out(browser, &dir, &pages);
    assert_eq!(found.len(), 2 * pages.len());
    for page in &found {
        println!("{page}");
        let at = |name: &str| page[name].as_f64().unwrap();
        assert!(at("said") <= at("top"), "{page}");
        assert!(
            at("picture") <= at("height") && at("big") <= at("height"),
            "{page}"
        );
        assert!(at("big") <= at("other"), "{page}");
        assert!(at("area") >= 0.2, "a small picture: {page}");
        assert_eq!(
            (page["figures"].as_u64(), at("broader")),
            (Some(3), 0.0),
            "{page}"
        );
    }
}
