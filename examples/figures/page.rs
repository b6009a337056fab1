//! The page: what a designer waits for. Taken at the server's door, over connections as a browser opens them; what only a
//! browser knows (paint, drag to picture on the screen) is printed by `.ci/page.mjs`.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::channel;
use std::time::{Duration, Instant};

use treewright::build::{Cache, Limits};
use treewright::preview::drafts::{Care, Draft, Show, Workshop};
use treewright::preview::{Preview, PreviewOptions};
use treewright::watch::Event;

use crate::Figure;

pub(crate) fn print() {
    drag();
    two_hundred();
    edits();
}

/// A trunk with some hundred branches.
const TREE: &str = "(
    height: 9.0,
    nodes: 12000,
    iterations: [
        (endpoints: Volume(shape: Point(height: 0.45), count: 1)),
        (endpoints: Volume(shape: HalfEllipsoid(bottom: 0.25, top: 1.0, radius: 0.4), count: 900)),
    ],
)";

/// Drag to picture: three trees in a pad, the point moved on a circle.
fn drag() {
    let folder = tempfile::tempdir().expect("a folder");
    let preset = folder.path().join("pad.ron");
    fs::write(folder.path().join("tree.ron"), TREE).expect("writes");
    let source = |name: &str, seed: u32| format!("\"{name}\": Grow(species: \"tree.ron\", seed: {seed}),");
    let sources = source("a", 1) + &source("b", 2) + &source("c", 3);
    let text = format!("(sources: {{{sources}}}, variants: [Source(\"a\")], foliage: (leaf: \"oak\"))");
    fs::write(&preset, text).expect("writes");
    let workshop = Workshop::new(Arc::new(Cache::default()), Limits::default());
    let place = |i: u32| {
        // To and fro, at two paces.
        let wave = |pace: f32| ((i as f32 * pace).fract() * 2.0 - 1.0).abs() * 1.6 + 0.2;
        let shares = [wave(0.043), wave(0.031), 1.0];
        let of = ["a", "b", "c"].iter().zip(shares).map(|(name, share)| ((*name).to_owned(), share)).collect();
        Draft {
            preset: "pad.ron".to_owned(),
            edits: std::collections::BTreeMap::new(),
            show: Show::Mix(of),
            turn: 26.0,
            elevation: 0.0,
            width: 640,
            height: 560,
            care: Care::Quick,
        }
    };
    let (mut times, mut chains, mut leaves) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..61 {
        let start = Instant::now();
        let Ok((_, facts)) = workshop.draw(&preset, &place(i)) else { return };
        if i > 0 {
            times.push(start.elapsed().as_secs_f64());
            chains.push(facts.chains);
            leaves.push(facts.leaves);
        }
    }
    chains.sort_unstable();
    leaves.sort_unstable();
    let how = format!(
        "mix of three sources, leaves, mesh, picture of 640 x 560 as PNG; median of 60 places, {} branches and {} leaves \
         at the median",
        chains[30], leaves[30]
    );
    Figure::new("page.drag_to_picture", median(times), "s", how).goal("<= 0.1 at 500 branches").print();
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Starts a preview and waits until all is built.
fn started(folder: &Path) -> Option<Preview> {
    let (say, said) = channel();
    let options = PreviewOptions::new(folder, folder.join("out"));
    let preview = Preview::start(options, move |event| {
        if matches!(event, Event::Idle { .. }) {
            let _ = say.send(());
        }
    });
    said.recv_timeout(Duration::from_secs(600)).ok()?;
    preview.ok()
}

/// A whole answer.
fn get(address: SocketAddr, path: &str) -> Option<Vec<u8>> {
    let mut stream = TcpStream::connect(address).ok()?;
    write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").ok()?;
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).ok()?;
    bytes.starts_with(b"HTTP/1.1 200").then_some(bytes)
}

/// The document, its files, the state and all pictures of 200 variants, by six connections at a time.
fn two_hundred() {
    let Ok(folder) = tempfile::tempdir() else { return };
    let sapling = TREE.replace("900", "24").replace("12000", "1500").replace("9.0", "3.0");
    let preset = "(sources: {\"a\": Grow(species: \"tree.ron\", seed: 1), \"b\": Grow(species: \"tree.ron\", seed: 2)},
        variants: [Blend(of: [\"a\", \"b\"], count: 200)], foliage: (leaf: \"birch\", density: 0.3, most: 200),
        lods: [Full, CrossedQuads], atlas: (size: 4096))";
    fs::write(folder.path().join("tree.ron"), sapling).expect("writes");
    fs::create_dir(folder.path().join("presets")).expect("makes");
    fs::write(folder.path().join("presets/many.ron"), preset.replace("tree.ron", "../tree.ron")).expect("writes");
    let Some(preview) = started(&folder.path().join("presets")) else { return };
    let address = preview.address();
    let all = || {
        let start = Instant::now();
        for path in ["/", "/page/style.css", "/page/main.js", "/page/kit.js", "/page/gallery.js"] {
            get(address, path)?;
        }
        let state = get(address, "/api/state")?;
        let first = start.elapsed().as_secs_f64();
        let next = std::sync::atomic::AtomicUsize::new(0);
        let shown = std::thread::scope(|scope| {
            let one = || {
                let mut shown = 0;
                loop {
                    let i = next.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
                    if i >= 200 {
                        return shown;
                    }
                    let path = format!("/picture/many/{i}?turn=26&width=300&height=360");
                    shown += usize::from(get(address, &path).is_some());
                }
            };
            let all: Vec<_> = (0..6).map(|_| scope.spawn(one)).collect();
            all.into_iter().map(|t| t.join().unwrap_or(0)).sum::<usize>()
        });
        (shown == 200).then_some((first, start.elapsed().as_secs_f64(), state.len()))
    };
    let Some((_, cold, _)) = all() else { return };
    let warm: Vec<(f64, f64, usize)> = (0..5).filter_map(|_| all()).collect();
    let of = |pick: fn(&(f64, f64, usize)) -> f64| median(warm.iter().map(pick).collect());
    let state = warm.first().map_or(0, |w| w.2) / 1024;
    let how = format!("the page's files and the state ({state} KiB), no picture; median of 5");
    Figure::new("page.document_200", of(|w| w.0), "s", how).goal("< 1").print();
    let how = "the same with all 200 pictures of 300 x 360, six connections, drawn before; median of 5";
    Figure::new("page.gallery_200", of(|w| w.1), "s", how).goal("< 1").print();
    let how = "the same, no picture drawn before; a browser asks for those in its window only";
    Figure::new("page.gallery_200_cold", cold, "s", how).print();
}

/// A preset saved on disk, until an open page hears of it, and until its set is there.
fn edits() {
    let project = crate::tiny::project();
    let Some(preview) = started(project.path()) else { return };
    let Ok(mut stream) = TcpStream::connect(preview.address()) else { return };
    let here = preview.address();
    if write!(stream, "GET /api/events HTTP/1.1\r\nHost: {here}\r\n\r\n").is_err() {
        return;
    }
    let _ = stream.set_read_timeout(Some(Duration::from_secs(60)));
    let (say, heard) = channel();
    std::thread::spawn(move || {
        let mut text = String::new();
        let mut bytes = [0; 4096];
        while let Ok(read @ 1..) = stream.read(&mut bytes) {
            text.push_str(&String::from_utf8_lossy(&bytes[..read]));
            while let Some(end) = text.find("\n\n") {
                let event: String = text.drain(..end + 2).collect();
                if say.send((Instant::now(), event)).is_err() {
                    return;
                }
            }
        }
    });
    let preset = project.path().join("grown.ron");
    let (mut news, mut sets, mut wrong) = (Vec::new(), Vec::new(), Vec::new());
    let until = |what: &str, since: Instant| loop {
        match heard.recv_timeout(Duration::from_secs(60)) {
            Ok((at, event)) if event.contains(what) => return Some((at - since).as_secs_f64()),
            Ok(_) => {}
            Err(_) => return None,
        }
    };
    for i in 0..9 {
        std::thread::sleep(Duration::from_millis(200));
        let start = Instant::now();
        fs::write(&preset, crate::tiny::GROWN.replace("seed: 1,", &format!("seed: {},", i + 2))).expect("writes");
        news.extend(until("building", start));
        sets.extend(until("built", start));
        std::thread::sleep(Duration::from_millis(200));
        let start = Instant::now();
        fs::write(&preset, crate::tiny::GROWN.replace("seed", "seeed")).expect("writes");
        wrong.extend(until("failed", start));
    }
    if news.len() < 9 || sets.len() < 9 || wrong.len() < 9 {
        return;
    }
    let goal = "<= 0.5";
    let how = "a preset saved, until an open page hears of it; median of 9";
    Figure::new("page.edit_to_event", median(news), "s", how).goal(goal).print();
    let how = "the same, until its set (one tree of 20 leaves) is on disk and told; median of 9";
    Figure::new("page.edit_to_set", median(sets), "s", how).goal(goal).print();
    let how = "a preset broken, until the page is told its errors; median of 9";
    Figure::new("page.edit_to_error", median(wrong), "s", how).goal(goal).print();
}
