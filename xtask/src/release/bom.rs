//! A bill of materials of what was built: CycloneDX 1.5, from `cargo metadata` and the checksums of
//! the lock file. No time and nothing random is in it, so that the same sources give the same file.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Value, json};

use super::sums;
use crate::stage::cargo_with;

/// What the bill is of.
pub struct Product<'a> {
    /// Its package.
    pub package: &'a str,
    /// The file that is handed out, and its bytes.
    pub file: &'a str,
    pub bytes: &'a [u8],
    /// `firmware` or `application`, as CycloneDX calls it.
    pub kind: &'static str,
    /// For which target it was built.
    pub target: &'a str,
    /// Version and commit of the release.
    pub version: &'a str,
    pub commit: &'a str,
}

/// What is known of a workspace's packages.
pub struct Tree {
    metadata: Value,
    /// SHA-256 of each package from a registry, by name and version.
    checksums: BTreeMap<String, String>,
}

impl Tree {
    /// That of the workspace in this folder, for a target. A lock file that does not fit is an
    /// error.
    pub fn of(folder: &Path, target: &str) -> Result<Self> {
        let mut cargo = cargo_with("metadata --format-version 1 --locked --filter-platform");
        let output = cargo
            .arg(target)
            .current_dir(folder)
            .output()
            .context("cannot start cargo")?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "cargo metadata: {said}");
        let lock = fs::read_to_string(folder.join("Cargo.lock")).context("Cargo.lock")?;
        Ok(Self {
            metadata: serde_json::from_slice(&output.stdout)?,
            checksums: checksums(&lock)?,
        })
    }

    /// The bill of a product: what is compiled into it, and what is only needed to build it
    /// (`scope` "excluded": build scripts, macros' dependencies of that kind).
    pub fn bill(&self, product: &Product<'_>) -> Result<Value> {
        let packages = by_id(&self.metadata["packages"])?;
        let root = packages
            .iter()
            .find(|(_, package)| package["name"] == product.package && package["source"].is_null());
        let (root, _) = root.with_context(|| format!("no package {}", product.package))?;
        let edges = edges(&self.metadata["resolve"]["nodes"])?;
        let inside = reached(root, &edges, |edge| edge.normal);
        let all = reached(root, &edges, |_| true);
        let reference = |id: &str| reference(packages[id]);
        let components: Vec<_> = all
            .iter()
            .filter(|id| *id != root)
            .map(|id| self.component(packages[*id], inside.contains(id)))
            .collect();
        let dependencies: Vec<_> = all
            .iter()
            .map(|id| {
                let to = edges.get(*id).into_iter().flatten();
                let to: BTreeSet<_> = to.map(|edge| reference(edge.to)).collect();
                json!({"ref": reference(id), "dependsOn": to})
            })
            .collect();
        let mut of = self.component(packages[root], true);
        of["type"] = product.kind.into();
        of["name"] = product.file.into();
        of["version"] = product.version.into();
        of["hashes"] = json!([{"alg": "SHA-256", "content": sums::hex(product.bytes)}]);
        of["properties"] = json!([
            {"name": "git:commit", "value": product.commit},
            {"name": "rust:target", "value": product.target},
        ]);
        if let Some(of) = of.as_object_mut() {
            of.remove("scope"); // that of a part
        }
        Ok(json!({
            "$schema": "http://cyclonedx.org/schema/bom-1.5.schema.json",
            "bomFormat": "CycloneDX",
            "specVersion": "1.5",
            "version": 1,
            "metadata": {"component": of},
            "components": components,
            "dependencies": dependencies,
        }))
    }

    fn component(&self, package: &Value, inside: bool) -> Value {
        let (name, version) = (text(&package["name"]), text(&package["version"]));
        let scope = if inside { "required" } else { "excluded" };
        let mut of = json!({
            "type": "library",
            "bom-ref": reference(package),
            "name": name,
            "version": version,
            "scope": scope,
        });
        if let Some(license) = package["license"].as_str() {
            let spelt = spdx::Expression::canonicalize(license).ok().flatten();
            let license = spelt.unwrap_or_else(|| license.to_owned());
            of["licenses"] = json!([{"expression": license}]);
        }
        if !package["source"].is_null() {
            of["purl"] = format!("pkg:cargo/{name}@{version}").into();
        }
        if let Some(sum) = self.checksums.get(&reference(package)) {
            of["hashes"] = json!([{"alg": "SHA-256", "content": sum}]);
        }
        of
    }
}

/// A dependency.
struct Edge<'a> {
    to: &'a str,
    /// Not only of a build script.
    normal: bool,
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

/// How a package is called within a bill.
fn reference(package: &Value) -> String {
    format!("{}@{}", text(&package["name"]), text(&package["version"]))
}

fn by_id(packages: &Value) -> Result<BTreeMap<&str, &Value>> {
    let packages = packages.as_array().context("no packages")?;
    let known = packages
        .iter()
        .map(|package| (text(&package["id"]), package));
    Ok(known.collect())
}

/// Who depends on whom, but for tests.
fn edges(nodes: &Value) -> Result<BTreeMap<&str, Vec<Edge<'_>>>> {
    let nodes = nodes.as_array().context("no resolved dependencies")?;
    let of = |node| -> Result<_> {
        let node: &Value = node;
        let deps = node["deps"].as_array().context("a package without deps")?;
        let edges = deps.iter().filter_map(|dep| {
            let kinds: Vec<_> = dep["dep_kinds"].as_array()?.iter().collect();
            let is = |name: Option<&str>| kinds.iter().any(|kind| kind["kind"].as_str() == name);
            let edge = Edge {
                to: text(&dep["pkg"]),
                normal: is(None),
            };
            (edge.normal || is(Some("build"))).then_some(edge)
        });
        Ok((text(&node["id"]), edges.collect()))
    };
    nodes.iter().map(of).collect()
}

fn reached<'a>(
    root: &'a str,
    edges: &BTreeMap<&'a str, Vec<Edge<'a>>>,
    through: impl Fn(&Edge<'_>) -> bool,
) -> BTreeSet<&'a str> {
    let (mut found, mut left) = (BTreeSet::new(), vec![root]);
    while let Some(id) = left.pop() {
        if found.insert(id) {
            let to = edges.get(id).into_iter().flatten();
            left.extend(to.filter(|edge| through(edge)).map(|edge| edge.to));
        }
    }
    found
}

/// Name and version to checksum, of a lock file.
fn checksums(lock: &str) -> Result<BTreeMap<String, String>> {
    let lock: toml::Table = toml::from_str(lock).context("Cargo.lock")?;
    let packages = lock.get("package").and_then(toml::Value::as_array);
    let packages = packages.context("Cargo.lock lists no packages")?;
    let known = packages.iter().filter_map(|package| {
        let field = |name: &str| package.get(name)?.as_str();
        let of = format!("{}@{}", field("name")?, field("version")?);
        Some((of, field("checksum")?.to_owned()))
    });
    Ok(known.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use qemu::images::workspace;

    fn product() -> Product<'static> {
        Product {
            package: "firmware",
            file: "stm32f405.elf",
            bytes: b"abc",
            kind: "firmware",
            target: "thumbv7em-none-eabihf",
            version: "1.2.3",
            commit: "0123",
        }
    }

    /// The bill of the real tree: what the schema of CycloneDX 1.5 asks for, and each reference to
    /// something that is there.
    #[test]
    fn a_bill_is_valid_and_complete() {
        let product = product();
        let tree = Tree::of(&workspace(), product.target).expect("a tree");
        let bill = tree.bill(&product).expect("a bill");
        assert_eq!(bill["bomFormat"], "CycloneDX");
        assert_eq!(bill["specVersion"], "1.5");
        let of = &bill["metadata"]["component"];
        assert_eq!(
            (&of["type"], &of["version"]),
            (&json!("firmware"), &json!("1.2.3"))
        );
        assert_eq!(of["hashes"][0]["content"], sums::hex(b"abc"));
        let components = bill["components"].as_array().expect("a list");
        let mut known = BTreeSet::from([text(&of["bom-ref"])]);
        for one in components {
            assert!(known.insert(text(&one["bom-ref"])), "twice: {one}");
            assert!(
                ["required", "excluded"].contains(&text(&one["scope"])),
                "{one}"
            );
            let license = text(&one["licenses"][0]["expression"]);
            spdx::Expression::parse(license).unwrap_or_else(|error| panic!("{one}: {error}"));
            let ours = one["purl"].is_null();
            let sum = text(&one["hashes"][0]["content"]);
            assert!(ours || sum.len() == 64, "{one}");
        }
        for one in bill["dependencies"].as_array().expect("a list") {
            assert!(known.contains(text(&one["ref"])), "{one}");
            for to in one["dependsOn"].as_array().expect("a list") {
                assert!(known.contains(text(to)), "{to} of {one}");
            }
        }
        let scope = |name: &str| {
            let one = components.iter().find(|one| one["name"] == name);
            one.map(|one| text(&one["scope"]))
        };
        assert_eq!(scope("lrnn-nostd"), Some("required"));
        assert_eq!(scope("stm32f4"), Some("required"));
        assert_eq!(scope("proptest"), None, "of tests only");
        assert_eq!(scope("plotters"), None, "of the desktop");
    }

    #[test]
    fn what_is_not_there_has_no_bill() {
        let tree = Tree::of(&workspace(), "thumbv7em-none-eabihf").expect("a tree");
        let product = Product {
            package: "libm", // there, but not ours
            ..product()
        };
        assert!(tree.bill(&product).is_err());
    }
}
