//! `cargo xtask supply`: what others wrote and we build. Licences, sources and duplicates are
//! checked here by `deny.toml`, offline and in a second. Where `cargo deny` is installed, it checks
//! the same by the same file and asks for advisories, which are a repository to be fetched.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::process::{Command, ExitCode, Stdio};

use anyhow::{Context, Result, bail, ensure};
use qemu::images::workspace;
use serde::Deserialize;
use serde_json::Value;

use crate::stage::{cargo_with, succeed};

/// How both tools are installed.
const DENY: &str = "cargo install --locked cargo-deny";
const CYCLONEDX: &str = "cargo install --locked cargo-cyclonedx";

/// The part of `deny.toml` that is checked here.
#[derive(Deserialize)]
struct Deny {
    licenses: Licenses,
    sources: Sources,
    bans: Bans,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

#[derive(Deserialize)]
struct Bans {
    #[serde(default)]
    skip: Vec<Skip>,
}

#[derive(Deserialize)]
struct Skip {
    /// Name and the beginning of a version.
    #[serde(rename = "crate")]
    name: String,
}

/// A package of the tree.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Package {
    name: String,
    version: String,
    license: Option<String>,
    /// `None`: of this workspace.
    source: Option<String>,
}

/// Checks the tree. Advisories are asked for where `cargo deny` is installed and can fetch them.
pub fn supply() -> Result<ExitCode> {
    check()?;
    if !installed("deny") {
        println!("advisories: not asked for; remedy: {DENY}");
        return Ok(ExitCode::SUCCESS);
    }
    succeed(&mut cargo_with("deny check licenses sources bans"))?;
    let mut fetch = cargo_with("deny fetch db");
    if fetch.stderr(Stdio::null()).status()?.success() {
        succeed(&mut cargo_with("deny check --disable-fetch advisories"))?;
    } else {
        println!("advisories: not asked for, their repository cannot be fetched from here");
    }
    Ok(ExitCode::SUCCESS)
}

/// The workspaces, each with a `deny.toml`: ours, that of the programs for the chip model, that
/// of the emulators, that of the boards over other people's drivers, and those of `lrnn-nostd`
/// alone.
const WORKSPACES: [&str; 7] = [
    ".",
    "tests/chip",
    "tests/rigless",
    "tests/rp2350",
    "firmware/boards",
    "tests/alone",
    "lrnn-nostd/examples/cortex-m",
];

/// Licences, sources and duplicates.
pub fn check() -> Result<()> {
    WORKSPACES.into_iter().try_for_each(check_one)
}

fn check_one(folder: &str) -> Result<()> {
    let file = workspace().join(folder).join("deny.toml");
    let text = fs::read_to_string(file).context("deny.toml")?;
    let deny: Deny = toml::from_str(&text).context("deny.toml")?;
    let mut metadata = cargo_with("metadata --format-version 1 --locked --all-features");
    let output = metadata
        .current_dir(workspace().join(folder))
        .output()
        .context("cannot start cargo")?;
    ensure!(
        output.status.success(),
        "cargo metadata: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    let packages = packages(&serde_json::from_slice(&output.stdout)?)?;
    let wrong = faults(&deny, &packages);
    if !wrong.is_empty() {
        bail!(
            "dependencies ({folder}/deny.toml):\n  {}",
            wrong.join("\n  ")
        );
    }
    println!(
        "{folder}: {} packages: licences, sources, duplicates",
        packages.len()
    );
    Ok(())
}

/// Writes a bill of materials for each package, beside its manifest.
pub fn sbom() -> Result<ExitCode> {
    ensure!(
        installed("cyclonedx"),
        "cargo-cyclonedx is missing; remedy: {CYCLONEDX}"
    );
    succeed(&mut cargo_with(
        "cyclonedx --format json --all-features --target all --override-filename bom",
    ))?;
    println!("bom.json in the folder of each package; firmware/bom.json is that of the images");
    Ok(ExitCode::SUCCESS)
}

fn installed(subcommand: &str) -> bool {
    let mut version: Command = cargo_with(subcommand);
    version.arg("--version").stdout(Stdio::null());
    let status = version.stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success())
}

/// What is reached from the workspace.
fn packages(metadata: &Value) -> Result<BTreeSet<Package>> {
    let list = |value: &Value, key: &str| -> Result<Vec<Value>> {
        let list = value[key].as_array().cloned();
        list.with_context(|| format!("cargo metadata tells no {key}"))
    };
    let text = |value: &Value| value.as_str().map(str::to_owned);
    let mut edges = BTreeMap::new();
    for node in list(&metadata["resolve"], "nodes")? {
        let to: Vec<_> = list(&node, "dependencies")?
            .iter()
            .filter_map(text)
            .collect();
        edges.insert(text(&node["id"]).unwrap_or_default(), to);
    }
    let mut left: Vec<_> = list(metadata, "workspace_members")?
        .iter()
        .filter_map(text)
        .collect();
    let mut reached = BTreeSet::new();
    while let Some(id) = left.pop() {
        if reached.insert(id.clone()) {
            left.extend(edges.get(&id).into_iter().flatten().cloned());
        }
    }
    let all = list(metadata, "packages")?;
    let ours = all.iter().filter(|package| {
        let id = package["id"].as_str().unwrap_or_default();
        reached.contains(id)
    });
    let package = |package: &Value| Package {
        name: text(&package["name"]).unwrap_or_default(),
        version: text(&package["version"]).unwrap_or_default(),
        license: text(&package["license"]),
        source: text(&package["source"]),
    };
    Ok(ours.map(package).collect())
}

/// What is not allowed, a sentence each.
fn faults(deny: &Deny, packages: &BTreeSet<Package>) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut versions: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for Package {
        name,
        version,
        license,
        source,
    } in packages
    {
        versions.entry(name).or_default().push(version);
        if !license
            .as_deref()
            .is_some_and(|license| allowed(&deny.licenses.allow, license))
        {
            let license = license.as_deref().unwrap_or("none");
            wrong.push(format!("{name} {version}: licence {license}"));
        }
        let registry = source
            .as_deref()
            .map(|source| source.trim_start_matches("registry+"));
        let known = registry.is_none_or(|url| deny.sources.allow_registry.iter().any(|a| a == url));
        if !known {
            wrong.push(format!(
                "{name} {version}: from {}",
                registry.unwrap_or_default()
            ));
        }
    }
    let mut skipped = BTreeSet::new();
    for (name, versions) in &versions {
        let skips = |version: &&&str| {
            let skip = deny.bans.skip.iter().find(|skip| {
                let (crate_name, begins) = skip.name.split_once('@').unwrap_or((&skip.name, ""));
                crate_name == *name && format!("{version}.").starts_with(&format!("{begins}."))
            });
            skip.inspect(|skip| {
                skipped.insert(&skip.name);
            })
            .is_none()
        };
        let kept: Vec<_> = versions.iter().filter(skips).collect();
        if versions.len() > 1 && kept.len() > 1 {
            wrong.push(format!("{name}: versions {versions:?}"));
        }
    }
    let stale = deny
        .bans
        .skip
        .iter()
        .filter(|skip| !skipped.contains(&skip.name));
    wrong.extend(stale.map(|skip| format!("deny.toml skips {}, which is not there", skip.name)));
    wrong
}

/// Whether an expression can be met with these licences.
fn allowed(allow: &[String], license: &str) -> bool {
    let Ok(expression) = spdx::Expression::parse_mode(license, spdx::ParseMode::LAX) else {
        return false;
    };
    expression.evaluate(|required| allow.iter().any(|known| *known == required.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn package(name: &str, version: &str, license: &str) -> Package {
        Package {
            name: name.into(),
            version: version.into(),
            license: Some(license.into()),
            source: Some("registry+here".into()),
        }
    }

    #[test]
    fn each_fault_is_named() {
        let deny = toml::from_str(
            "licenses.allow = ['MIT', 'Apache-2.0 WITH LLVM-exception', 'Zlib']\n\
             sources.allow-registry = ['here']\n\
             bans.skip = [{ crate = 'twice@1' }, { crate = 'gone@2' }]",
        );
        let deny: Deny = deny.unwrap();
        let good = [
            package("a", "1.0.0", "MIT/Apache-2.0"),
            package("b", "1.0.0", "GPL-3.0-only OR Zlib"),
            package("c", "1.0.0", "Apache-2.0 WITH LLVM-exception"),
            package("twice", "1.5.0", "MIT"),
            package("twice", "2.0.0", "MIT"),
        ];
        let only = faults(&deny, &good.clone().into_iter().collect());
        assert_eq!(only, ["deny.toml skips gone@2, which is not there"]);
        let bad = [
            package("d", "1.0.0", "GPL-3.0-only"),
            package("e", "1.0.0", "MIT AND Apache-2.0"),
            package("twice", "3.0.0", "MIT"),
            Package {
                source: Some("git+elsewhere".into()),
                ..package("f", "1.0.0", "MIT")
            },
            Package {
                license: None,
                ..package("h", "1.0.0", "")
            },
        ];
        let all = faults(&deny, &good.into_iter().chain(bad).collect());
        assert_eq!(all.len(), 6, "{all:?}");
    }
}
