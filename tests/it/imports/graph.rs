//! [`Graph`]: what imports what, and the circles in it.

use super::source::Imports;
use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write as _,
};

/// A graph by the names of its nodes.
#[derive(Default)]
pub(super) struct Graph {
    pub(super) nodes: BTreeSet<String>,
    /// With how many imports there are, and where the first one is.
    pub(super) edges: BTreeMap<(String, String), (usize, String)>,
}

impl Graph {
    pub(super) fn of_files(imports: &Imports) -> Self {
        Self::of(imports, |file| Some(file.into()))
    }

    /// Files as nodes of the given names, or of none.
    pub(super) fn of(imports: &Imports, name: impl Fn(&str) -> Option<String>) -> Self {
        let mut graph = Self { nodes: imports.files.iter().filter_map(|file| name(file)).collect(), ..Self::default() };
        for ((from, to), line) in &imports.edges {
            let [from, to] = [from, to].map(|file| imports.files[*file].as_str());
            let (Some(a), Some(b)) = (name(from), name(to)) else { continue };
            if a != b {
                let edge = graph.edges.entry((a, b)).or_insert_with(|| (0, format!("{from}:{line} -> {to}")));
                edge.0 += 1;
            }
        }
        graph
    }

    fn next<'a>(&'a self, from: &'a str) -> impl Iterator<Item = &'a str> {
        self.edges.keys().filter(move |(a, _)| a == from).map(|(_, b)| b.as_str())
    }

    /// A shortest way from a node back to it.
    fn circle_through<'a>(&'a self, start: &'a str) -> Option<Vec<&'a str>> {
        let mut before: BTreeMap<&str, &str> = BTreeMap::new();
        let mut queue = vec![start];
        let mut done = 0;
        while let Some(&at) = queue.get(done) {
            done += 1;
            for next in self.next(at) {
                if next == start {
                    let mut way = vec![start, at];
                    while way[way.len() - 1] != start {
                        way.push(before[way[way.len() - 1]]);
                    }
                    way.reverse();
                    return Some(way);
                }
                if !before.contains_key(next) {
                    before.insert(next, at);
                    queue.push(next);
                }
            }
        }
        None
    }

    fn reached<'a>(&'a self, start: &'a str) -> BTreeSet<&'a str> {
        let (mut reached, mut queue) = (BTreeSet::new(), vec![start]);
        while let Some(at) = queue.pop() {
            queue.extend(self.next(at).filter(|next| reached.insert(*next)));
        }
        reached
    }

    /// Sets of nodes that all reach each other, of two and more.
    pub(super) fn circles(&self) -> Vec<BTreeSet<&str>> {
        let reached: BTreeMap<&str, BTreeSet<&str>> =
            self.nodes.iter().map(|node| (node.as_str(), self.reached(node))).collect();
        let mut circles = Vec::new();
        for (node, to) in &reached {
            let circle: BTreeSet<&str> = to.iter().filter(|other| reached[*other].contains(node)).copied().collect();
            if circle.len() > 1 && circle.first() == Some(node) {
                circles.push(circle);
            }
        }
        circles
    }

    /// An order of the nodes, importers first, that has few imports against it, and the number of these.
    pub(super) fn order(&self) -> (Vec<&str>, usize) {
        let mut left: BTreeSet<&str> = self.nodes.iter().map(String::as_str).collect();
        let (mut top, mut bottom) = (Vec::new(), Vec::new());
        while !left.is_empty() {
            let count = |node: &str| {
                let (mut to, mut from) = (0, 0);
                for ((a, b), (n, _)) in &self.edges {
                    if a == node && left.contains(b.as_str()) {
                        to += *n as i64;
                    } else if b == node && left.contains(a.as_str()) {
                        from += *n as i64;
                    }
                }
                (to, from)
            };
            let counts: Vec<_> = left.iter().map(|node| (*node, count(node))).collect();
            let last = counts.iter().find(|(_, (to, _))| *to == 0);
            let first = counts.iter().max_by_key(|(_, (to, from))| if *from == 0 { i64::MAX } else { to - from });
            let Some((node, _)) = last.or(first) else { break };
            left.remove(node);
            if last.is_some() { bottom.push(*node) } else { top.push(*node) }
        }
        top.extend(bottom.into_iter().rev());
        let place = |node: &str| top.iter().position(|other| *other == node);
        let against = self.edges.iter().filter(|((a, b), _)| place(a) > place(b)).map(|(_, (n, _))| n).sum();
        (top, against)
    }

    /// Lists the circles that are not allowed.
    pub(super) fn check(&self, what: &str, is_allowed: impl Fn(&BTreeSet<&str>) -> bool) -> Result<(), String> {
        let circles: Vec<_> = self.circles().into_iter().filter(|circle| !is_allowed(circle)).collect();
        let mut told = String::new();
        let mut shown = BTreeSet::new();
        for circle in &circles {
            let _ = writeln!(told, "{} {what} import each other in a circle: {circle:?}", circle.len());
            for node in circle {
                let way = self.circle_through(node).unwrap_or_default();
                if shown.insert(way.iter().copied().collect::<BTreeSet<_>>()) {
                    let _ = writeln!(told, "  a shortest circle through {node}:");
                    for pair in way.windows(2) {
                        let _ = writeln!(told, "    {}", self.edges[&(pair[0].into(), pair[1].into())].1);
                    }
                }
            }
        }
        if told.is_empty() { Ok(()) } else { Err(told) }
    }
}
