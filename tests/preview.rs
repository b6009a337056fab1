//! The page's server: it serves the project and nothing else, to its own page and to nobody else, whatever is sent to
//! it, and what is decided on the page goes into the preset's text.

#![cfg(feature = "preview")]

#[expect(dead_code, reason = "what other tests need of it")]
mod tiny;

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use treewright::preview::{Preview, PreviewOptions};

/// How long anything may take. A bound, no measure.
const PATIENCE: Duration = Duration::from_secs(60);

/// Two grown trees and three between them; small enough to be built in a blink.
const PAIR: &str = r#"// Two and what lies between.
(
    seed: 3,
    sources: {
        "a": Grow(species: "species/tiny.ron", seed: 1), // the first
        "b": Grow(species: "species/tiny.ron", seed: 2, height: 4.0),
    },
    variants: [
        Source("a"),
        Blend(of: ["a", "b"], count: 3),
    ],
    foliage: (leaf: Files(color: "art/leaf.png"), density: 0.1, most: 20),
    bark: (texture: Files(color: "art/bark.png")),
    lods: [Full, CrossedQuads],
    atlas: (size: 256),
)
"#;

struct Page {
    project: tempfile::TempDir,
    preview: Preview,
}

struct Answer {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Answer {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&self.body)))
    }

    fn read(mut stream: TcpStream) -> Option<Self> {
        let mut bytes = Vec::new();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // A connection that is cut off has said what it had to say.
        let _ = stream.read_to_end(&mut bytes);
        let split = bytes.windows(4).position(|w| w == b"\r\n\r\n")?;
        let head = String::from_utf8_lossy(&bytes[..split]).to_ascii_lowercase();
        let status = head.split(' ').nth(1)?.parse().ok()?;
        let mut body = bytes[split + 4..].to_vec();
        if head.contains("transfer-encoding: chunked") {
            body = unchunked(&body);
        }
        Some(Self { status, head, body })
    }
}

fn unchunked(mut bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    while let Some(line) = bytes.windows(2).position(|w| w == b"\r\n") {
        let size = usize::from_str_radix(&String::from_utf8_lossy(&bytes[..line]), 16).unwrap_or(0);
        let rest = &bytes[line + 2..];
        if size == 0 || rest.len() < size + 2 {
            break;
        }
        out.extend(&rest[..size]);
        bytes = &rest[size + 2..];
    }
    out
}

impl Page {
    /// The tiny project with a preset `pair.ron`, built.
    fn start() -> Self {
        Self::with(|_| {})
    }

    fn with(change: impl FnOnce(&mut PreviewOptions)) -> Self {
        let project = tiny::project();
        fs::remove_file(project.path().join("grown.ron")).unwrap();
        fs::write(project.path().join("pair.ron"), PAIR).unwrap();
        fs::write(project.path().join("secret.txt"), "secret").unwrap();
        let mut options = PreviewOptions::new(project.path(), project.path().join("out"));
        change(&mut options);
        let preview = Preview::start(options, |_| {}).unwrap();
        let page = Self { project, preview };
        page.until("it is built", |state| state["idle"] == true && variants(state).len() == 4);
        page
    }

    fn address(&self) -> SocketAddr {
        self.preview.address()
    }

    fn connect(&self) -> TcpStream {
        TcpStream::connect(self.address()).unwrap()
    }

    /// Sends some bytes as they are.
    fn raw(&self, bytes: &[u8]) -> Option<Answer> {
        let mut stream = self.connect();
        // The other end may close in between.
        let _ = stream.write_all(bytes);
        Answer::read(stream)
    }

    fn get(&self, path: &str) -> Answer {
        self.get_as(path, &self.address().to_string(), "")
    }

    fn get_as(&self, path: &str, host: &str, more: &str) -> Answer {
        let text = format!("GET {path} HTTP/1.1\r\nHost: {host}\r\n{more}Connection: close\r\n\r\n");
        self.raw(text.as_bytes()).expect("an answer")
    }

    fn post(&self, path: &str, body: &Value) -> Answer {
        self.post_as(path, body.to_string().as_bytes(), "Content-Type: application/json\r\n")
    }

    fn post_as(&self, path: &str, body: &[u8], more: &str) -> Answer {
        let (here, length) = (self.address(), body.len());
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: {here}\r\n{more}Content-Length: {length}\r\nConnection: close\r\n\r\n"
        );
        self.raw(&[head.as_bytes(), body].concat()).expect("an answer")
    }

    fn until(&self, what: &str, holds: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let asked = format!("GET /api/state HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address());
            // No answer: all places are taken.
            let state = self.raw(asked.as_bytes()).map_or(Value::Null, |answer| answer.json());
            if holds(&state) {
                return state;
            }
            assert!(start.elapsed() < PATIENCE, "{what}: {state:#}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    fn text(&self) -> String {
        fs::read_to_string(self.project.path().join("pair.ron")).unwrap()
    }

    /// Everything in the project but the sets.
    fn files(&self) -> Vec<(String, Vec<u8>)> {
        fn walk(folder: &Path, into: &mut Vec<(String, Vec<u8>)>) {
            for entry in fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() && !path.ends_with("out") {
                    walk(&path, into);
                } else if path.is_file() {
                    into.push((path.display().to_string(), fs::read(&path).unwrap()));
                }
            }
        }
        let mut files = Vec::new();
        walk(self.project.path(), &mut files);
        files.sort();
        files
    }
}

fn variants(state: &Value) -> Vec<Value> {
    state["sets"][0]["variants"].as_array().cloned().unwrap_or_default()
}

#[test]
fn the_page_its_sets_and_its_pictures_are_served() {
    let page = Page::start();
    let document = page.get("/");
    assert!(document.status == 200 && document.head.contains("content-security-policy: default-src 'none'"));
    let text = String::from_utf8(document.body).unwrap();
    assert!(!text.contains("http://") && !text.contains("https://"), "nothing comes from elsewhere");
    for file in ["style.css", "main.js", "gallery.js", "stage.js", "space.js", "explore.js", "tune.js", "sketch.js"] {
        let answer = page.get(&format!("/page/{file}"));
        assert!(answer.status == 200 && !answer.body.is_empty(), "{file}");
        assert!(!String::from_utf8(answer.body).unwrap().contains("https://"), "{file}");
    }
    let state = page.get("/api/state").json();
    let first = &variants(&state)[0];
    assert_eq!((first["name"].as_str(), first["levels"].as_array().map(Vec::len)), (Some("pair_001"), Some(2)));
    let glb = page.get("/set/pair/pair_001.glb");
    assert!(glb.status == 200 && glb.body.starts_with(b"glTF"));
    assert_eq!(glb.body, fs::read(page.project.path().join("out/pair/pair_001.glb")).unwrap());
    let tag = glb.head.lines().find_map(|line| line.strip_prefix("etag: ")).unwrap().to_owned();
    let again =
        page.get_as("/set/pair/pair_001.glb", &page.address().to_string(), &format!("If-None-Match: {tag}\r\n"));
    assert_eq!((again.status, again.body.len()), (304, 0));
    for query in ["", "?level=1&turn=90&width=200&height=100", "?turn=-400&width=300&height=99999"] {
        let picture = page.get(&format!("/picture/pair/2{query}"));
        assert_eq!(picture.status, 200, "{query}");
        let image = image::load_from_memory(&picture.body).unwrap().into_rgba8();
        assert!(image.pixels().any(|p| p.0[3] > 200) && image.pixels().any(|p| p.0[3] == 0), "{query}");
    }
}

#[test]
fn nothing_but_the_sets_is_served_however_it_is_asked_for() {
    let page = Page::start();
    let before = page.files();
    for path in [
        "/secret.txt",
        "/set/pair/secret.txt",
        "/set/pair/../../secret.txt",
        "/set/pair/..%2f..%2fsecret.txt",
        "/set/pair/%2e%2e%2f%2e%2e%2fsecret.txt",
        "/set/..%2f/secret.txt",
        "/set/%2fetc/passwd",
        "/set/pair/%2fetc%2fpasswd",
        "/set/pair/..%5c..%5csecret.txt",
        "/set/pair/pair_001.glb%00.txt",
        "/set//secret.txt",
        "/page/..%2fmod.rs",
        "/page/%2e%2e/%2e%2e/Cargo.toml",
        "/three/..%2f..%2fpackage.json",
        "/three/three.module.js",
        "//etc/passwd",
        "/../../../../etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/picture/pair/999",
        "/picture/..%2f/0",
        "/picture/pair/-1",
        "/set/pair/.treewright-lock",
        "/api/knobs?preset=pair.ron&file=../secret.txt",
        "/api/knobs?preset=pair.ron&file=secret.txt",
        "/api/knobs?preset=..%2fpair.ron",
        "/api/knobs?preset=pair.ron&file=%2fetc%2fpasswd",
        "/api/nothing",
    ] {
        let answer = page.get(path);
        assert!((400..500).contains(&answer.status), "{path}: {}", answer.status);
        let body = String::from_utf8_lossy(&answer.body);
        assert!(!body.contains("secret") && !body.contains("root:"), "{path}: {body}");
    }
    #[cfg(unix)]
    {
        // A link in the folder of sets leads out of it.
        let glb = page.project.path().join("out/pair/pair_002.glb");
        fs::remove_file(&glb).unwrap();
        std::os::unix::fs::symlink(page.project.path().join("secret.txt"), &glb).unwrap();
        assert_eq!(page.get("/set/pair/pair_002.glb").status, 404);
    }
    for edits in [json!({"../secret.txt": []}), json!({"/etc/passwd": []}), json!({"species/../../secret.txt": []})] {
        let draft = json!({"preset": "pair.ron", "edits": edits, "show": {"variant": 0}, "width": 64, "height": 64});
        assert_eq!(page.post("/api/draft", &draft).status, 422);
    }
    assert_eq!(page.files(), before, "nothing is written");
}

#[test]
fn other_pages_and_other_names_are_sent_away() {
    let page = Page::start();
    let before = page.files();
    let here = page.address();
    let port = here.port();
    assert_eq!(page.get_as("/api/state", &format!("localhost:{port}"), "").status, 200);
    for host in ["evil.example", &format!("evil.example:{port}"), "localhost", &format!("localhost:{}", port ^ 1), ""] {
        assert_eq!(page.get_as("/api/state", host, "").status, 421, "{host}");
    }
    let no_host = page.raw(b"GET /api/state HTTP/1.1\r\nConnection: close\r\n\r\n");
    assert!(no_host.is_none_or(|answer| answer.status == 421 || answer.status == 400));
    let own = here.to_string();
    for origin in ["http://evil.example", "null", "https://localhost", &format!("http://localhost.evil.example:{port}")]
    {
        assert_eq!(page.get_as("/api/state", &own, &format!("Origin: {origin}\r\n")).status, 403, "{origin}");
    }
    assert_eq!(page.get_as("/api/state", &own, &format!("Origin: http://{own}\r\n")).status, 200);
    assert_eq!(page.get_as("/api/events", &own, "Sec-Fetch-Site: cross-site\r\n").status, 403);
    let decide = json!({"preset": "pair.ron", "index": 1, "key": "x", "decision": "reject"}).to_string();
    for (more, status) in [
        ("", 415),
        ("Content-Type: text/plain\r\n", 415),
        ("Content-Type: application/x-www-form-urlencoded\r\n", 415),
        ("Content-Type: application/json\r\nOrigin: http://evil.example\r\n", 403),
        ("Content-Type: application/json\r\nSec-Fetch-Site: same-site\r\n", 403),
    ] {
        assert_eq!(page.post_as("/api/decide", decide.as_bytes(), more).status, status, "{more}");
    }
    let other = page
        .raw(format!("DELETE /set/pair/pair_001.glb HTTP/1.1\r\nHost: {own}\r\nConnection: close\r\n\r\n").as_bytes());
    assert_eq!(other.unwrap().status, 405);
    assert_eq!(page.files(), before, "nothing is written");
}

#[test]
fn what_is_too_large_or_no_request_is_refused_and_the_page_goes_on() {
    let page = Page::start();
    let before = page.files();
    let own = page.address();
    assert_eq!(page.get(&format!("/{}", "a".repeat(5000))).status, 414);
    let heads = format!("GET / HTTP/1.1\r\nHost: {own}\r\nX: {}\r\n\r\n", "a".repeat(200_000));
    assert!(page.raw(heads.as_bytes()).is_none_or(|answer| (400..500).contains(&answer.status)));
    let many = format!("GET / HTTP/1.1\r\nHost: {own}\r\n{}\r\n", "X: y\r\n".repeat(5000));
    assert!(page.raw(many.as_bytes()).is_none_or(|answer| (400..500).contains(&answer.status)));
    let large = vec![b' '; (1 << 20) + 1];
    for path in ["/api/draft", "/api/save", "/api/decide", "/api/sketch"] {
        assert_eq!(page.post_as(path, &large, "Content-Type: application/json\r\n").status, 413, "{path}");
        for body in [&b"{}"[..], b"", b"[", b"null", b"\xff\xfe", &b"[".repeat(100_000)] {
            let status = page.post_as(path, body, "Content-Type: application/json\r\n").status;
            assert_eq!(status, 400, "{path}");
        }
    }
    // A length that is not kept.
    let claimed = format!(
        "POST /api/save HTTP/1.1\r\nHost: {own}\r\nContent-Type: application/json\r\nContent-Length: 99999999999\r\n\r\n{{}}"
    );
    let mut stream = page.connect();
    stream.write_all(claimed.as_bytes()).unwrap();
    drop(stream);
    for noise in [
        &b"\0\0\0\0\0\0\0\0\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        &[0x16, 3, 1, 2, 0, 1, 0, 1, 0xfc, 3, 3],
    ] {
        let mut stream = page.connect();
        let _ = stream.write_all(noise);
    }
    let points: Vec<[f64; 2]> = (0..5000).map(|i| [f64::from(i), 1.0]).collect();
    let crown = json!({"preset": "pair.ron", "of": "a", "name": "../../x", "points": points});
    assert_eq!(page.post("/api/sketch", &crown).status, 422);
    assert_eq!(page.get("/api/state").status, 200);
    assert_eq!(page.files(), before, "nothing is written");
}

#[test]
fn silent_and_slow_clients_keep_nobody_waiting_for_long() {
    let page = Page::start();
    // More than there are places, all half-way through a request.
    let own = page.address();
    let slow: Vec<TcpStream> = (0..100)
        .filter_map(|_| {
            let mut stream = TcpStream::connect(own).ok()?;
            stream.write_all(format!("GET /api/state HTTP/1.1\r\nHost: {own}\r\nX: ").as_bytes()).ok()?;
            Some(stream)
        })
        .collect();
    let start = Instant::now();
    loop {
        let mut stream = page.connect();
        let asked = format!("GET /api/state HTTP/1.1\r\nHost: {own}\r\nConnection: close\r\n\r\n");
        let _ = stream.write_all(asked.as_bytes());
        if Answer::read(stream).is_some_and(|answer| answer.status == 200) {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "the places are never given back");
        std::thread::sleep(Duration::from_millis(200));
    }
    drop(slow);
    // Who listens and never reads is let go; who listens and reads hears.
    let deaf: Vec<TcpStream> = (0..20)
        .map(|_| {
            let mut stream = page.connect();
            let asked = format!("GET /api/events HTTP/1.1\r\nHost: {own}\r\n\r\n");
            stream.write_all(asked.as_bytes()).unwrap();
            stream
        })
        .collect();
    assert_eq!(page.get("/api/state").status, 200);
    drop(deaf);
}

/// Sends a request's first bytes at once and the rest byte by byte, until the other end has had enough; what it said.
fn dripped(page: &Page, first: &str, rest: u8) -> Option<Answer> {
    let mut stream = page.connect();
    stream.write_all(first.as_bytes()).unwrap();
    let start = Instant::now();
    stream.set_nonblocking(true).unwrap();
    let mut said = [0; 1];
    loop {
        assert!(start.elapsed() < PATIENCE, "a client that drips is never let go");
        // Something to read, or nothing more to come, is an end; so is a connection that takes no more.
        let is_over = !matches!(stream.peek(&mut said), Err(error) if error.kind() == std::io::ErrorKind::WouldBlock);
        if is_over || stream.write(&[rest]).is_err() {
            break;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    stream.set_nonblocking(false).unwrap();
    Answer::read(stream)
}

#[test]
fn heads_and_bodies_that_drip_are_cut_off_while_others_are_served() {
    let page = Page::with(|options| options.patience = Duration::from_millis(400));
    let before = page.files();
    let own = page.address();
    let head = format!("GET /api/state HTTP/1.1\r\nHost: {own}\r\nX: ");
    let post = |path: &str| {
        format!(
            "POST {path} HTTP/1.1\r\nHost: {own}\r\nContent-Type: application/json\r\nContent-Length: 1000000\r\n\r\n{{"
        )
    };
    std::thread::scope(|scope| {
        let bodies = ["/api/save", "/api/decide", "/api/sketch", "/api/draft"];
        let bodies: Vec<_> = bodies.map(|path| scope.spawn(|| dripped(&page, &post(path), b' '))).into_iter().collect();
        let heads: Vec<_> = (0..8).map(|_| scope.spawn(|| dripped(&page, &head, b'a'))).collect();
        assert_eq!(page.get("/api/state").status, 200, "others are served meanwhile");
        for body in bodies {
            assert!(body.join().unwrap().is_none_or(|answer| answer.status == 408));
        }
        for head in heads {
            assert!(head.join().unwrap().is_none_or(|answer| (400..500).contains(&answer.status)));
        }
    });
    // A body that never comes, whose sender then only listens.
    let answer = page.raw(post("/api/save").as_bytes()).expect("an answer");
    assert_eq!(answer.status, 408);
    assert_eq!(page.files(), before, "nothing is written");
}

#[test]
fn many_half_open_connections_take_no_more_than_there_are_places() {
    let page = Page::start();
    let own = page.address();
    // Each holds as much of a head as is read of one, and never ends it: what is not let go would take 20 MB.
    let head = format!("GET / HTTP/1.1\r\nHost: {own}\r\nX: {}", "a".repeat(60_000));
    let open: Vec<TcpStream> = (0..300)
        .map(|_| {
            let mut stream = page.connect();
            stream.set_write_timeout(Some(Duration::from_secs(5))).unwrap();
            let _ = stream.write_all(head.as_bytes());
            stream.set_nonblocking(true).unwrap();
            stream
        })
        .collect();
    let is_open = |stream: &&TcpStream| {
        let mut byte = [0; 1];
        matches!(stream.peek(&mut byte), Err(error) if error.kind() == std::io::ErrorKind::WouldBlock)
    };
    let start = Instant::now();
    while open.iter().filter(is_open).count() > 64 {
        assert!(start.elapsed() < PATIENCE, "more connections are held than there are places");
        std::thread::sleep(Duration::from_millis(20));
    }
    drop(open);
    page.until("it goes on", |state| state["idle"] == true);
}

#[test]
fn an_edit_is_told_and_a_broken_preset_keeps_its_set_and_shows_its_lines() {
    let page = Page::start();
    let mut events = page.connect();
    let own = page.address();
    events.write_all(format!("GET /api/events HTTP/1.1\r\nHost: {own}\r\n\r\n").as_bytes()).unwrap();
    events.set_read_timeout(Some(PATIENCE)).unwrap();
    let mut heard = String::new();
    let mut hear = |what: &str| {
        let mut bytes = [0; 4096];
        while !heard.contains(what) {
            let read = events.read(&mut bytes).unwrap();
            assert!(read > 0, "{heard}");
            heard.push_str(&String::from_utf8_lossy(&bytes[..read]));
        }
        heard.clear();
    };
    hear("retry");
    let preset = page.project.path().join("pair.ron");
    fs::write(&preset, PAIR.replace("count: 3", "cuont: 3")).unwrap();
    hear("\"failed\"");
    let state = page.until("it fails", |state| !state["sets"][0]["errors"].as_array().is_none_or(Vec::is_empty));
    assert_eq!(variants(&state).len(), 4, "the last good set stays");
    let errors = &state["sets"][0]["errors"];
    let error = errors.as_array().unwrap().iter().find(|e| e["message"] == "unknown field").unwrap();
    assert_eq!((error["file"].as_str(), error["line"].as_u64()), (Some("pair.ron"), Some(10)));
    let line = error["lines"].as_array().unwrap().iter().find(|l| l[0] == 10).unwrap()[1].as_str().unwrap();
    let mark = [error["mark"][0].as_u64().unwrap() as usize, error["mark"][1].as_u64().unwrap() as usize];
    assert_eq!(&line[mark[0]..mark[1]], "cuont");
    assert_eq!(page.get("/picture/pair/1").status, 200);
    fs::write(&preset, PAIR.replace("count: 3", "count: 4")).unwrap();
    hear("\"built\"");
    let state = page.until("it is mended", |state| variants(state).len() == 5);
    assert_eq!(state["sets"][0]["errors"], json!([]));
}

#[test]
fn what_is_kept_stays_what_is_rejected_goes_and_the_text_keeps_its_comments() {
    let page = Page::start();
    let state = page.get("/api/state").json();
    let all = variants(&state);
    assert_eq!(all.iter().map(|v| v["number"].as_u64()).collect::<Vec<_>>(), [None, Some(1), Some(2), Some(3)]);
    let decide = |state: &Value, index: usize, decision: &str| {
        let key = &state["sets"][0]["key"];
        page.post("/api/decide", &json!({"preset": "pair.ron", "index": index, "key": key, "decision": decision}))
    };
    assert_eq!(decide(&state, 0, "keep").status, 422, "a source is no choice");
    assert_eq!(decide(&json!({"sets": [{"key": "old"}]}), 1, "keep").status, 409);
    assert_eq!(decide(&state, 3, "keep").status, 200);
    assert_eq!(page.text(), PAIR.replace("count: 3)", "count: 3, keep: [3])"));
    let state = page.until("it is kept", |state| variants(state).get(3).is_some_and(|v| v["kept"] == true));
    assert_eq!(decide(&state, 1, "reject").status, 200);
    assert_eq!(page.text(), PAIR.replace("count: 3)", "count: 3, keep: [3], reject: [1])"));
    let numbers = |state: &Value| variants(state).iter().map(|v| v["number"].as_u64()).collect::<Vec<_>>();
    let state = page.until("it gives way", |state| numbers(state) == [None, Some(2), Some(3), Some(4)]);
    // The kept tree is the one that it was, under its new name.
    let seeds = |all: &[Value]| all.iter().map(|v| v["seed"].clone()).collect::<Vec<_>>();
    assert_eq!(seeds(&variants(&state))[1..3], seeds(&all)[2..4]);
    assert_eq!(decide(&state, 0, "forgive").status, 200);
    let state = page.until("it may come back", |state| numbers(state) == [None, Some(1), Some(2), Some(3)]);
    assert_eq!(decide(&state, 3, "free").status, 200);
    assert_eq!(page.text(), PAIR);
}

#[test]
fn mixes_edits_and_sketches_are_drawn_before_they_are_saved() {
    let page = Page::start();
    let draft = |edits: Value, show: Value| {
        let asked =
            json!({"preset": "pair.ron", "edits": edits, "show": show, "width": 96, "height": 128, "care": "quick"});
        let answer = page.post("/api/draft", &asked);
        let facts = answer.head.lines().find_map(|line| line.strip_prefix("x-treewright: ")).map(str::to_owned);
        (answer.status, facts.map(|f| serde_json::from_str::<Value>(&f).unwrap()), answer.body)
    };
    let (status, facts, one) = draft(json!({}), json!({"mix": [["a", 0.9], ["b", 0.1]]}));
    assert!(status == 200 && facts.unwrap()["chains"].as_u64() > Some(0));
    let other = draft(json!({}), json!({"mix": [["a", 0.1], ["b", 0.9]]})).2;
    assert!(image::load_from_memory(&one).is_ok() && one != other);
    let taller = json!({"species/tiny.ron": [{"path": "height", "value": "9.0"}]});
    let (_, facts, _) = draft(taller.clone(), json!({"source": "a"}));
    assert!(facts.unwrap()["height"].as_f64() > Some(6.0));
    // What the command line would tell of the source is told of its draft.
    let notes = |edits: Value| draft(edits, json!({"source": "a"})).1.unwrap()["notes"].clone();
    let slim = notes(json!({"species/tiny.ron": [{"path": "slenderness", "value": "60.0"}]}));
    assert!(slim.to_string().contains("longer than 60 times the radius shed"), "{slim}");
    assert!(!notes(json!({})).to_string().contains("longer than 60"));
    let (status, _, body) =
        draft(json!({"species/tiny.ron": [{"path": "height", "value": "-9.0"}]}), json!({"source": "a"}));
    let told: Value = serde_json::from_slice(&body).unwrap();
    assert!(status == 422 && told["errors"][0]["field"] == "height", "{told}");
    let points = json!([[-1.5, 1.0], [1.5, 1.0], [0.0, 4.5]]);
    let (status, facts, _) = draft(json!({}), json!({"sketch": {"of": "a", "points": points}}));
    assert!(status == 200 && facts.unwrap()["height"].as_f64() > Some(3.2));
    // Saved, the species is the drafted one, with its comments and order.
    let knobs = page.get("/api/knobs?preset=pair.ron&file=species/tiny.ron").json();
    // Sources say whether a height of their own stands above the species'.
    let heights: Vec<&Value> = knobs["sources"].as_array().unwrap().iter().map(|s| &s["height"]).collect();
    assert_eq!(heights, [&Value::Null, &json!("4.0")]);
    let height = knobs["knobs"].as_array().unwrap().iter().find(|k| k["path"] == "height").unwrap();
    assert_eq!(
        (height["value"].as_str(), height["low"].as_f64(), height["unit"].as_str()),
        (Some("3.0"), Some(0.1), Some("m"))
    );
    let save = |base: &Value| {
        let edits = json!([{"path": "height", "value": "9.0"}]);
        page.post("/api/save", &json!({"preset": "pair.ron", "file": "species/tiny.ron", "base": base, "edits": edits}))
    };
    assert_eq!(save(&json!("0")).status, 409);
    assert_eq!(save(&knobs["base"]).status, 200);
    let species = fs::read_to_string(page.project.path().join("species/tiny.ron")).unwrap();
    assert_eq!(species, tiny::SPECIES.replace("height: 3.0", "height: 9.0"));
    let crown = json!({"preset": "pair.ron", "of": "b", "name": "spike", "points": points});
    assert_eq!(page.post("/api/sketch", &crown).json()["added"], true);
    assert!(page.project.path().join("sketches/spike.svg").is_file());
    let entry = "count: 3),\n        Sketch(of: \"b\", crown: \"sketches/spike.svg\", size: Metres(4.50)),";
    assert_eq!(page.text(), PAIR.replace("count: 3),", entry));
    page.until("the sketched tree is built", |state| variants(state).len() == 5);
    // A line over a part, drawn from the side and half above.
    let stroke = json!({"of": "b", "points": [[0.1, 2.2], [0.7, 2.9], [0.9, 2.2], [0.6, 1.6]], "open": true,
        "view": 90.0, "elevation": 45.0});
    let (status, facts, picture) = draft(json!({}), json!({"sketch": stroke}));
    assert!(status == 200 && image::load_from_memory(&picture).is_ok(), "{facts:?}");
    let mut line = stroke;
    line["preset"] = json!("pair.ron");
    line["name"] = json!("line");
    assert_eq!(page.post("/api/sketch", &line).json()["added"], true);
    assert!(page.text().contains("crown: \"sketches/line.svg\", view: 90.0, elevation: 45.0, size: Metres("));
    page.until("the tree with the line is built", |state| variants(state).len() == 6);
    line["elevation"] = json!(100.0);
    assert_eq!(page.post("/api/sketch", &line).status, 422);
    // One over the other: drawn over the tree that the crown gave, and saved as one entry.
    let crown = json!({"points": points, "open": false});
    let over = json!({"of": "b", "before": [crown], "points": [[0.4, 3.2], [1.6, 2.6], [1.2, 1.4]], "open": true, "view": 90.0});
    let mut nothing = over.clone();
    nothing["points"] = json!([]);
    let alone = draft(json!({}), json!({"sketch": {"of": "b", "points": points}})).2;
    assert!(
        draft(json!({}), json!({"sketch": nothing})).2 == alone && draft(json!({}), json!({"sketch": over})).2 != alone
    );
    let mut over = over;
    over["preset"] = json!("pair.ron");
    over["name"] = json!("both");
    assert_eq!(page.post("/api/sketch", &over).json()["added"], true);
    let then = "crown: \"sketches/both.svg\", size: Metres(4.50), then: [(crown: \"sketches/both-2.svg\", view: 90.0, size: Metres(";
    assert!(page.text().contains(then) && page.project.path().join("sketches/both-2.svg").is_file(), "{}", page.text());
    page.until("the tree that is drawn over twice is built", |state| variants(state).len() == 7);
}
