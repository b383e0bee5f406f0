//! All generated tables and pictures of the pages.

use anyhow::Result;

use super::{campaigns, drive, measured, real, sensors};
use crate::{alone, beside, growth};

/// A generated part of the pages.
pub struct Figure {
    pub name: &'static str,
    /// The pages and pictures that it writes, from the top of the workspace.
    pub files: &'static [&'static str],
    /// A description.
    pub what: &'static str,
    pub how: How,
    /// How long it takes, in words, with the machine's two cores to itself.
    pub takes: &'static str,
    /// Whether it is made when no figure is named.
    pub cheap: bool,
}

/// How a figure is made.
pub enum How {
    /// A function of this program.
    Here(fn() -> Result<()>),
    /// A command of `host-sim` that writes the page after `--results`, with its figures beside it.
    HostSim(&'static [&'static str]),
}

impl How {
    /// The command in words.
    pub fn command(&self, name: &str) -> String {
        match self {
            Self::Here(_) => format!("cargo xtask figures {name}"),
            Self::HostSim(words) => format!("cargo run --release -- {}", words.join(" ")),
        }
    }
}

/// All figures. The cheap ones come last, since they read what the others write.
pub const FIGURES: &[Figure] = &[
    Figure {
        name: "results",
        files: &["docs/RESULTS.md", "docs/RESULTS.csv"],
        what: "the campaign beside classical filters",
        how: How::HostSim(&[
            "campaign",
            "--runs",
            "50",
            "--ablation",
            "--results",
            "docs/RESULTS.md",
        ]),
        takes: "five minutes",
        cheap: false,
    },
    Figure {
        name: "abuse",
        files: &["docs/ABUSE.md", "docs/ABUSE.csv"],
        what: "the device in a hostile world",
        how: How::Here(campaigns::abuse),
        takes: "an hour, estimated; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "memory",
        files: &["docs/figures/memory.csv"],
        what: "memory over power-offs beside classical filters",
        how: How::Here(campaigns::memory),
        takes: "four minutes; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "memory-causes",
        files: &["docs/figures/memory-causes.csv"],
        what: "the same with single causes of error",
        how: How::Here(campaigns::causes),
        takes: "eight minutes; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "memory-real",
        files: &["docs/figures/memory-real.csv"],
        what: "the same with power-ons like those of recorded units",
        how: How::Here(campaigns::real),
        takes: "two minutes; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "memory-vehicles",
        files: &["docs/figures/memory-vehicles.csv"],
        what: "the same in other vehicles",
        how: How::Here(campaigns::vehicles),
        takes: "four minutes; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "sensors",
        files: &["docs/figures/sensors.csv"],
        what: "what memory is worth to each sensor with a preset",
        how: How::Here(sensors::sensors),
        takes: "a quarter of an hour; what was interrupted goes on",
        cheap: false,
    },
    Figure {
        name: "start",
        files: &["docs/START.md"],
        what: "how the device starts",
        how: How::HostSim(&["start", "--results", "docs/START.md"]),
        takes: "not measured",
        cheap: false,
    },
    Figure {
        name: "growth",
        files: &[
            "docs/PERFORMANCE.md",
            "docs/growth-nets.svg",
            "docs/growth-rate.svg",
            "docs/growth-runs.svg",
            "docs/growth-weights.svg",
        ],
        what: "how cost grows (`cargo xtask growth`)",
        how: How::Here(|| growth::growth().map(drop)),
        takes: "minutes; not measured",
        cheap: false,
    },
    Figure {
        name: "beside",
        files: &["docs/PERFORMANCE.md"],
        what: "beside AllanTools and KF-GINS, and a day at 200 Hz (`cargo xtask beside`)",
        how: How::Here(|| beside::beside().map(drop)),
        takes: "minutes, 3 GB of disk; not measured",
        cheap: false,
    },
    Figure {
        name: "alone",
        files: &["lrnn-nostd/README.md"],
        what: "`lrnn-nostd` on every core (`cargo xtask alone`)",
        how: How::Here(|| alone::alone().map(drop)),
        takes: "minutes; not measured",
        cheap: false,
    },
    Figure {
        name: "runs",
        files: &["docs/figures/drive.csv"],
        what: "60 seeds of the default scenario",
        how: How::Here(drive::runs),
        takes: "3 minutes of processor time, 2.9 s a seed",
        cheap: false,
    },
    Figure {
        name: "real",
        files: &[
            "docs/figures/real-rc-car.csv",
            "docs/figures/real-car.csv",
            "docs/figures/real-hand-a.csv",
            "docs/figures/real-hand-b.csv",
            "docs/figures/real-hand-c.csv",
            "docs/figures/real-paper.csv",
        ],
        what: "real units over their power-ons, from the folder of recorded data",
        how: How::Here(real::write),
        takes: "half a minute",
        cheap: false,
    },
    Figure {
        name: "works",
        files: &["docs/figures/works.csv"],
        what: "instructions of each piece of work, in QEMU",
        how: How::Here(measured::works),
        takes: "a minute",
        cheap: false,
    },
    Figure {
        name: "path",
        files: &["docs/figures/path.csv"],
        what: "instructions of a sample of each format, in QEMU",
        how: How::Here(measured::path),
        takes: "two minutes",
        cheap: false,
    },
    Figure {
        name: "images",
        files: &["docs/figures/images.csv"],
        what: "flash, variables and bound of the stack of each image and board",
        how: How::Here(measured::images),
        takes: "minutes; not measured",
        cheap: false,
    },
    Figure {
        name: "tables",
        files: &[
            "README.md",
            "docs/BOARDS.md",
            "docs/ICD.md",
            "docs/LEARNING.md",
            "docs/MEMORY.md",
            "docs/PERFORMANCE.md",
            "docs/PYTHON.md",
            "docs/REAL.md",
            "docs/RELIABILITY.md",
            "docs/paper.md",
            "docs/sensors.md",
        ],
        what: "tables of the pages that stand in docs/figures/*.csv",
        how: How::Here(super::tables::write),
        takes: "at once",
        cheap: true,
    },
];

/// Pictures and tables that no command makes. Those that are copied into docs/figures name the
/// command that printed them (`super::copied`).
pub const BY_HAND: &[(&str, &str)] = &[
    (
        "docs/architecture.svg, docs/rehearsal.svg, docs/wiring.svg, docs/report-rehearsals.svg",
        "drawn; the last one by `host-sim report`",
    ),
    (
        "docs/five-minutes.md, docs/paper.md",
        "what `host-sim run` prints; tests/system/tests/run.rs compares it with a run",
    ),
    (
        "docs/BOARDS.md",
        "what has judged what: tests/qemu/tests/chip, dma and pico.rs assert it",
    ),
    (
        "docs/LEARNING.md, docs/MEMORY.md",
        "figures in the text that name a command or a test beside them",
    ),
];
