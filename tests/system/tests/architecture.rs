//! Compares `docs/ARCHITECTURE.md` and its picture with the source tree: every room is listed, in
//! an order in which each room imports only rooms below it.
//!
//! A room is a module directly in the `src` folder of a crate. The tables of the page list the
//! rooms of a part from high to low; the desktop's part has several crates. Code that is compiled
//! for tests only is left out.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The parts whose rooms the page lists.
const PARTS: [&str; 2] = ["firmware", "host-sim"];

fn workspace() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).expect("tests/system").to_path_buf()
}

fn text(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A room as the page lists it.
#[derive(Debug)]
struct Room {
    name: String,
    /// Folder of its crate, from the workspace.
    package: String,
}

impl Room {
    /// A row of a table: `` | `room` | what it is | `` or `` | `room` | `crate` | what it is | ``.
    fn of(row: &str, part: &str) -> Option<Room> {
        let mut cells = row.strip_prefix("| `")?.split(" | ");
        let name = cells.next()?.trim_end_matches('`').to_owned();
        let second = cells.next()?;
        let package = second.strip_prefix('`').and_then(|c| c.strip_suffix('`'));
        let package = match package {
            Some(package) if package != part => format!("{part}/{package}"),
            _ => part.to_owned(),
        };
        Some(Room { name, package })
    }

    fn src(&self) -> PathBuf {
        workspace().join(&self.package).join("src")
    }

    /// Whether the room is a whole crate.
    fn is_crate(&self) -> bool {
        let src = self.src();
        let inside = [src.join(&self.name), src.join(format!("{}.rs", self.name))];
        !inside.iter().any(|path| path.exists())
    }
}

/// The rooms of a part as the page lists them, from high to low.
fn listed(part: &str) -> Vec<Room> {
    let page = text(&workspace().join("docs/ARCHITECTURE.md"));
    let heading = format!("## `{part}`");
    let section = page
        .split_once(&heading)
        .unwrap_or_else(|| panic!("docs/ARCHITECTURE.md has no heading {heading}"))
        .1;
    let section = section.split("\n## ").next().unwrap_or_default();
    section
        .lines()
        .filter_map(|row| Room::of(row, part))
        .collect()
}

/// The modules in the `src` folders of the crates of a part.
fn standing(rooms: &[Room]) -> BTreeSet<String> {
    let mut all = BTreeSet::new();
    for room in rooms {
        if room.is_crate() {
            all.insert(room.name.clone());
            continue;
        }
        for entry in std::fs::read_dir(room.src()).expect("a readable folder") {
            let path = entry.expect("a readable entry").path();
            let stem = path.file_stem().and_then(|stem| stem.to_str());
            all.extend(stem.map(str::to_owned));
        }
    }
    for not in ["lib", "main", "bin"] {
        all.remove(not);
    }
    all
}

/// The source files of a room: `room.rs` and all below `room/`.
fn files(room: &Room) -> Vec<PathBuf> {
    let src = room.src();
    let mut found = vec![src.join(format!("{}.rs", room.name))];
    let mut folders = vec![if room.is_crate() {
        src
    } else {
        src.join(&room.name)
    }];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).into_iter().flatten() {
            let path = entry.expect("a readable entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.retain(|path| path.is_file());
    found
}

/// The names of modules and crates in a file.
#[derive(Default)]
struct Mentions {
    /// First names after `crate::`.
    own: BTreeSet<String>,
    /// First names after the other crates of the desktop, as in `host_core::inertial`; the name of
    /// a crate that is a room.
    others: BTreeSet<String>,
    /// Modules that are compiled for tests only.
    test_modules: BTreeSet<String>,
}

impl Mentions {
    fn of(path: &Path) -> Mentions {
        let tokens: TokenStream = text(path)
            .parse()
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut mentions = Mentions::default();
        mentions.read(tokens);
        mentions
    }

    fn read(&mut self, tokens: TokenStream) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            if is_test_only(&tokens[at..]) {
                at += self.skip_item(&tokens[at..]);
                continue;
            }
            match token {
                TokenTree::Ident(name) if name == "crate" => {
                    self.own.extend(names(tokens.get(at + 3)));
                }
                TokenTree::Ident(name) => {
                    if let Some(package) = name.to_string().strip_prefix("host_") {
                        self.others.insert(package.to_owned());
                        self.others.extend(names(tokens.get(at + 3)));
                    }
                }
                _ => {}
            }
            if let TokenTree::Group(group) = token {
                self.read(group.stream());
            }
            at += 1;
        }
    }

    /// Skips an item after `#[cfg(test)]` and returns its number of tokens; notes a module that has
    /// a file of its own.
    fn skip_item(&mut self, tokens: &[TokenTree]) -> usize {
        let end = |token: &TokenTree| match token {
            TokenTree::Punct(mark) => mark.as_char() == ';',
            TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
            _ => false,
        };
        let len = 2 + tokens[2..].iter().position(end).map_or(0, |at| at + 1);
        let item = &tokens[..len];
        if let Some(at) = item.iter().position(|token| is_ident(token, "mod"))
            && let Some(TokenTree::Ident(name)) = item.get(at + 1)
        {
            self.test_modules.insert(name.to_string());
        }
        len
    }
}

/// The first names of what follows `crate::`: a path, or a group of paths.
fn names(next: Option<&TokenTree>) -> Vec<String> {
    match next {
        Some(TokenTree::Ident(name)) => vec![name.to_string()],
        Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace => {
            let mut found = Vec::new();
            let mut first = true;
            for token in group.stream() {
                match token {
                    TokenTree::Ident(name) if first => {
                        found.push(name.to_string());
                        first = false;
                    }
                    TokenTree::Punct(mark) if mark.as_char() == ',' => first = true,
                    _ => {}
                }
            }
            found
        }
        _ => Vec::new(),
    }
}

fn is_ident(token: &TokenTree, name: &str) -> bool {
    matches!(token, TokenTree::Ident(ident) if ident == name)
}

fn is_test_only(tokens: &[TokenTree]) -> bool {
    let [TokenTree::Punct(mark), TokenTree::Group(group), ..] = tokens else {
        return false;
    };
    mark.as_char() == '#' && group.stream().to_string().replace(' ', "") == "cfg(test)"
}

/// The rooms that the product code of a room imports.
fn imports(room: &Room) -> BTreeSet<String> {
    let files = files(room);
    assert!(!files.is_empty(), "{room:?} has no source file");
    let mentions: Vec<(PathBuf, Mentions)> = files
        .into_iter()
        .map(|path| (path.clone(), Mentions::of(&path)))
        .collect();
    let tests: BTreeSet<&String> = mentions.iter().flat_map(|(_, m)| &m.test_modules).collect();
    let for_tests = |path: &Path| {
        let mut names = path
            .iter()
            .filter_map(|name| Path::new(name).file_stem()?.to_str());
        names.any(|name| tests.iter().any(|test| *test == name))
    };
    let product = mentions.iter().filter(|(path, _)| !for_tests(path));
    let mut all = BTreeSet::new();
    for (_, mentions) in product {
        all.extend(mentions.others.clone());
        if !room.is_crate() {
            all.extend(mentions.own.clone());
        }
    }
    all
}

#[test]
fn every_room_is_listed_and_drawn() {
    let picture = text(&workspace().join("docs/architecture.svg"));
    for part in PARTS {
        let listed = listed(part);
        let set: BTreeSet<String> = listed.iter().map(|room| room.name.clone()).collect();
        assert_eq!(
            set,
            standing(&listed),
            "rooms of {part}: the page and the tree"
        );
        assert_eq!(set.len(), listed.len(), "{part}: a room is listed twice");
        for room in &listed {
            let id = format!("id=\"{part}/{}\"", room.name);
            assert!(picture.contains(&id), "docs/architecture.svg has no {id}");
        }
        let prefix = format!("id=\"{part}/");
        let drawn = picture.matches(&prefix).count();
        assert_eq!(
            drawn,
            listed.len(),
            "docs/architecture.svg: rooms of {part}"
        );
    }
}

#[test]
fn each_room_imports_only_rooms_below_it() {
    let mut arrows = 0;
    for part in PARTS {
        let order = listed(part);
        for (height, room) in order.iter().enumerate() {
            for imported in imports(room) {
                // a name that is not a room is defined in lib.rs, as a re-export or a macro
                let Some(below) = order.iter().position(|room| room.name == imported) else {
                    continue;
                };
                arrows += usize::from(below != height);
                assert!(
                    below >= height,
                    "{part}: `{}` imports `{imported}`, which docs/ARCHITECTURE.md lists above it",
                    room.name
                );
            }
        }
    }
    assert!(arrows > 50, "only {arrows} imports were found");
}

#[test]
fn the_reader_of_imports_finds_groups_and_leaves_out_tests() {
    let mut mentions = Mentions::default();
    let source = "use crate::{a::{x, y}, b}; // crate::c\n fn f() { crate::d::g(\"crate::e\") }\n\
                  #[cfg(test)] mod tests; #[cfg(test)] mod inline { use crate::h; }\
                  use crate::i::j;\
                  use host_core::{k, l::m}; use host_report::n;";
    mentions.read(source.parse().expect("Rust"));
    assert!(mentions.own.iter().eq(["a", "b", "d", "i"]));
    assert!(mentions.others.iter().eq(["core", "k", "l", "n", "report"]));
    assert!(mentions.test_modules.contains("tests"));
}
