//! Lists what a crate makes public, from its text: every item that can be named from outside, at the paths where it can,
//! with its fields, variants, methods and traits.
//!
//! rustdoc's JSON would say the same and needs a nightly compiler. The text is enough here since the crate has no macro
//! that makes public items and no `pub use …::*`; both make the walk panic. Types in signatures stay as they are
//! written, without their modules. All features are listed, each item behind one under its name.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::spanned::Spanned;
use syn::{Attribute, Fields, ImplItem, Item, TraitItem, UseTree, Visibility};

/// Path of a module, `["preset", "plan"]`; that of the crate is empty.
type Path_ = Vec<String>;

struct Module {
    items: Vec<Item>,
    /// What is named here by `use` or declared as a module or item: name to absolute path.
    names: BTreeMap<String, Path_>,
    /// The names that are public here, and the features they are behind.
    shown: BTreeMap<String, String>,
}

/// The lines of a crate's public face, sorted.
pub(crate) fn listing(lib: &Path) -> Vec<String> {
    let mut modules = BTreeMap::new();
    read(lib, &lib.with_extension(""), Vec::new(), &mut modules);
    let mut lister = Lister { modules, lines: BTreeSet::new(), traits: BTreeMap::new() };
    lister.module(&[], "treewright", "");
    for (at, traits) in std::mem::take(&mut lister.traits) {
        lister.lines.insert(format!("{}: impl {}", at.0, traits.into_iter().collect::<Vec<_>>().join(", ")) + &at.1);
    }
    lister.lines.into_iter().collect()
}

/// Reads a file of a module and those of the modules in it. `beside` is where its children lie.
fn read(file: &Path, beside: &Path, path: Path_, modules: &mut BTreeMap<Path_, Module>) {
    let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let items = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display())).items;
    let folder = if path.is_empty() { beside.parent().unwrap().to_owned() } else { beside.to_owned() };
    let mut module = Module { items: Vec::new(), names: BTreeMap::new(), shown: BTreeMap::new() };
    for item in items.into_iter().filter(|item| !is_test(attributes(item))) {
        if let Item::Mod(inner) = &item {
            let name = inner.ident.to_string();
            assert!(inner.content.is_none(), "{}: mod {name} {{ }} is in no file of its own", file.display());
            let child: PathBuf = [format!("{name}.rs"), format!("{name}/mod.rs")]
                .iter()
                .map(|end| folder.join(end))
                .find(|path| path.is_file())
                .unwrap_or_else(|| panic!("{}: no file of mod {name}", file.display()));
            read(&child, &folder.join(&name), joined(&path, &name), modules);
        }
        match &item {
            Item::Use(used) => {
                let public = matches!(used.vis, Visibility::Public(_));
                let feature = feature(&used.attrs);
                for (name, target) in uses(&used.tree, &[]) {
                    assert!(!(public && name == "*"), "{}: pub use …::*", file.display());
                    if public {
                        module.shown.insert(name.clone(), feature.clone());
                    }
                    module.names.insert(name, absolute(&target, &path));
                }
            }
            Item::Macro(_) => {}
            _ => {
                if let Some((name, visibility)) = named(&item) {
                    if matches!(visibility, Visibility::Public(_)) {
                        module.shown.insert(name.clone(), feature(attributes(&item)));
                    }
                    module.names.insert(name.clone(), joined(&path, &name));
                }
            }
        }
        module.items.push(item);
    }
    modules.insert(path, module);
}

struct Lister {
    modules: BTreeMap<Path_, Module>,
    lines: BTreeSet<String>,
    /// The traits of each type, by its path and the features it is behind.
    traits: BTreeMap<(String, String), BTreeSet<String>>,
}

impl Lister {
    fn line(&mut self, text: String, feature: &str) {
        self.lines.insert(format!("{text}{feature}"));
    }

    fn is(&mut self, at: &str, feature: &str, name: String) {
        self.traits.entry((at.to_owned(), feature.to_owned())).or_default().insert(name);
    }

    /// What is public in a module, as it is reached by `at`.
    fn module(&mut self, path: &[String], at: &str, feature: &str) {
        self.line(format!("{at}: mod"), feature);
        let shown: Vec<_> = self.modules[path].shown.clone().into_iter().collect();
        for (name, own) in shown {
            let feature = if own.is_empty() { feature } else { own.as_str() };
            let target = self.resolved(joined(path, &name));
            let at = format!("{at}::{name}");
            if self.modules.contains_key(&target) {
                self.module(&target, &at, feature);
                continue;
            }
            let (module, item) = target.split_at(target.len() - 1);
            let found = self.modules.get(module).map(|module| {
                let own = module.items.iter().filter(|i| named(i).is_some_and(|(name, _)| name == item[0]));
                own.cloned().collect::<Vec<_>>()
            });
            match found {
                Some(items) if !items.is_empty() => {
                    for item in items {
                        self.item(&item, &at, feature);
                    }
                    self.impls(&target, &at, feature);
                }
                _ => self.line(format!("{at} = {}", target.join("::")), feature),
            }
        }
    }

    /// Follows `use`s to where a thing is declared.
    fn resolved(&self, mut path: Path_) -> Path_ {
        for _ in 0..32 {
            let longest = (0..path.len()).rev().find(|&n| self.modules.contains_key(&path[..n]));
            let Some(n) = longest else { return path };
            let Some(next) = self.modules[&path[..n]].names.get(&path[n]) else { return path };
            let next: Path_ = next.iter().chain(&path[n + 1..]).cloned().collect();
            if next == path {
                return path;
            }
            path = next;
        }
        path
    }

    fn item(&mut self, item: &Item, at: &str, feature: &str) {
        match item {
            Item::Struct(it) => {
                self.line(format!("{at}: struct{}", text(&it.generics)), feature);
                self.derives(&it.attrs, at, feature);
                self.fields(&it.fields, at, feature, Seen::ByVisibility);
            }
            Item::Enum(it) => {
                let open = if has(&it.attrs, "non_exhaustive") { ", non-exhaustive" } else { "" };
                self.line(format!("{at}: enum{}{open}", text(&it.generics)), feature);
                self.derives(&it.attrs, at, feature);
                for variant in &it.variants {
                    let at = format!("{at}::{}", variant.ident);
                    self.line(format!("{at}: variant"), feature);
                    self.fields(&variant.fields, &at, feature, Seen::Always);
                }
            }
            Item::Trait(it) => {
                self.line(format!("{at}: trait{}", text(&it.generics)), feature);
                for inner in &it.items {
                    if let TraitItem::Fn(function) = inner {
                        self.line(format!("{at}: {}", text(&function.sig)), feature);
                    }
                }
            }
            Item::Fn(it) => self.line(format!("{at}: {}", text(&it.sig)), feature),
            Item::Const(it) => self.line(format!("{at}: const {}", text(&it.ty)), feature),
            Item::Static(it) => self.line(format!("{at}: static {}", text(&it.ty)), feature),
            Item::Type(it) => self.line(format!("{at}{}: type = {}", text(&it.generics), text(&it.ty)), feature),
            _ => self.line(format!("{at}: ?"), feature),
        }
    }

    fn fields(&mut self, fields: &Fields, at: &str, feature: &str, seen: Seen) {
        let mut hidden = false;
        for (i, field) in fields.iter().enumerate() {
            let name = field.ident.as_ref().map_or_else(|| i.to_string(), ToString::to_string);
            if seen == Seen::Always || matches!(field.vis, Visibility::Public(_)) {
                self.line(format!("{at}.{name}: {}", text(&field.ty)), feature);
            } else {
                hidden = true;
            }
        }
        if hidden {
            self.line(format!("{at}: has hidden fields"), feature);
        }
    }

    fn derives(&mut self, attributes: &[Attribute], at: &str, feature: &str) {
        for attribute in attributes.iter().filter(|a| a.path().is_ident("derive")) {
            let _ = attribute.parse_nested_meta(|meta| {
                let name = meta.path.segments.last().map(|s| s.ident.to_string()).unwrap_or_default();
                self.is(at, feature, name);
                Ok(())
            });
        }
    }

    /// The methods and traits of a type, wherever in the crate they are written.
    fn impls(&mut self, target: &[String], at: &str, feature: &str) {
        let (mut lines, mut traits) = (Vec::new(), Vec::new());
        for (path, module) in &self.modules {
            for item in &module.items {
                let Item::Impl(it) = item else { continue };
                let syn::Type::Path(own) = &*it.self_ty else { continue };
                let own = own.path.segments.iter().map(|s| s.ident.to_string()).collect::<Vec<_>>();
                if self.resolved(absolute(&own, path)) != target {
                    continue;
                }
                if let Some((_, of, _)) = &it.trait_ {
                    traits.push(text(of));
                    continue;
                }
                for inner in &it.items {
                    match inner {
                        ImplItem::Fn(f) if matches!(f.vis, Visibility::Public(_)) && !is_test(&f.attrs) => {
                            lines.push(format!("{at}: {}", text(&f.sig)));
                        }
                        ImplItem::Const(c) if matches!(c.vis, Visibility::Public(_)) => {
                            lines.push(format!("{at}::{}: const {}", c.ident, text(&c.ty)));
                        }
                        _ => {}
                    }
                }
            }
        }
        for line in lines {
            self.line(line, feature);
        }
        for name in traits {
            self.is(at, feature, name);
        }
    }
}

/// Which fields can be seen from outside.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Seen {
    ByVisibility,
    Always,
}

fn joined(path: &[String], name: &str) -> Path_ {
    path.iter().cloned().chain([name.to_owned()]).collect()
}

/// A path that was written in a module, from the crate's root.
fn absolute(written: &[String], module: &[String]) -> Path_ {
    let mut path: Path_ = module.to_vec();
    let mut rest = written;
    loop {
        match rest.first().map(String::as_str) {
            Some("crate") => path = Vec::new(),
            Some("super") => drop(path.pop()),
            Some("self") => {}
            _ => break,
        }
        rest = &rest[1..];
    }
    path.extend(rest.iter().cloned());
    path
}

/// What a `use` names: the name here, and the path as it is written.
fn uses(tree: &UseTree, before: &[String]) -> Vec<(String, Path_)> {
    match tree {
        UseTree::Path(it) => uses(&it.tree, &joined(before, &it.ident.to_string())),
        UseTree::Name(it) if it.ident == "self" => vec![(before.last().cloned().unwrap_or_default(), before.to_vec())],
        UseTree::Name(it) => vec![(it.ident.to_string(), joined(before, &it.ident.to_string()))],
        UseTree::Rename(it) => vec![(it.rename.to_string(), joined(before, &it.ident.to_string()))],
        UseTree::Glob(_) => vec![("*".to_owned(), before.to_vec())],
        UseTree::Group(it) => it.items.iter().flat_map(|tree| uses(tree, before)).collect(),
    }
}

fn named(item: &Item) -> Option<(String, &Visibility)> {
    let (name, visibility) = match item {
        Item::Struct(it) => (&it.ident, &it.vis),
        Item::Enum(it) => (&it.ident, &it.vis),
        Item::Trait(it) => (&it.ident, &it.vis),
        Item::Fn(it) => (&it.sig.ident, &it.vis),
        Item::Const(it) => (&it.ident, &it.vis),
        Item::Static(it) => (&it.ident, &it.vis),
        Item::Type(it) => (&it.ident, &it.vis),
        Item::Mod(it) => (&it.ident, &it.vis),
        _ => return None,
    };
    Some((name.to_string(), visibility))
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Struct(it) => &it.attrs,
        Item::Enum(it) => &it.attrs,
        Item::Trait(it) => &it.attrs,
        Item::Fn(it) => &it.attrs,
        Item::Const(it) => &it.attrs,
        Item::Static(it) => &it.attrs,
        Item::Type(it) => &it.attrs,
        Item::Mod(it) => &it.attrs,
        Item::Use(it) => &it.attrs,
        Item::Impl(it) => &it.attrs,
        _ => &[],
    }
}

fn has(attributes: &[Attribute], name: &str) -> bool {
    attributes.iter().any(|a| a.path().is_ident(name))
}

/// The condition of a `cfg`, as it is written.
fn condition(attributes: &[Attribute]) -> Option<String> {
    let cfg = attributes.iter().find(|a| a.path().is_ident("cfg"))?;
    cfg.meta.require_list().ok().map(text)
}

fn is_test(attributes: &[Attribute]) -> bool {
    condition(attributes).is_some_and(|c| c == "cfg(test)")
}

fn feature(attributes: &[Attribute]) -> String {
    condition(attributes).map(|c| format!("  [{c}]")).unwrap_or_default()
}

/// A piece of source as it is written, on one line.
fn text(node: &impl Spanned) -> String {
    let written = node.span().source_text().unwrap_or_default();
    let line = written.split_whitespace().collect::<Vec<_>>().join(" ");
    line.replace("( ", "(").replace(", )", ")").replace("< ", "<").replace(", >", ">").replace("[ ", "[")
}
