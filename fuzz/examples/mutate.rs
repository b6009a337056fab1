//! `cargo run --release --example mutate -- READER SECONDS [FOLDER]…`: damages the seeds of a reader, and small files of
//! the folders, over and over; stops at the first panic, or at a file that takes more memory or time than it may, and
//! writes it to `artifacts/`. READER is a folder of `seeds`. Without SECONDS (0) it only reads the densest files of every
//! format: one of a megabyte each, made to take as much memory as it can.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use treewright_fuzz::{PART, most, peak, read, read_as};

/// Largest file of a folder that is damaged.
const LARGEST: u64 = 200_000;
/// Longest that a damaged file may take.
const SLOWEST: Duration = Duration::from_secs(10);

/// xorshift64*, so that a run can be repeated.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }
}

fn mutate(bytes: &mut Vec<u8>, other: &[u8], random: &mut Random) {
    for _ in 0..1 + random.below(6) {
        let at = random.below(bytes.len());
        let span = 1 + random.below(64);
        match random.below(8) {
            _ if bytes.is_empty() => bytes.extend(other.iter().take(100)),
            0 => bytes[at] = random.next() as u8,
            1 => bytes[at] = b'0' + random.below(10) as u8,
            2 => bytes.truncate(at.max(1)),
            3 => {
                let copy = bytes[at..(at + span).min(bytes.len())].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, copy);
            }
            4 => drop(bytes.drain(at..(at + span).min(bytes.len()))),
            5 => {
                let from = random.below(other.len());
                bytes.splice(at..at, other[from..(from + span).min(other.len())].iter().copied());
            }
            6 => {
                let special: [&[u8]; 10] = [
                    b"-1",
                    b"nan",
                    b"1e400",
                    b"4294967295",
                    b"99999999999",
                    b"\xff\xff\xff\xff",
                    b"\n",
                    b"\t",
                    b"/",
                    b"0",
                ];
                bytes.splice(at..at, special[random.below(10)].iter().copied());
            }
            _ => bytes[at] ^= 1 << random.below(8),
        }
    }
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|e| e.path()).collect();
    found.retain(|f| f.metadata().is_ok_and(|m| m.is_file() && m.len() <= LARGEST));
    found.sort();
    found
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seconds: u64 = arguments.get(1).and_then(|s| s.parse().ok()).unwrap_or(0);
    if seconds == 0 {
        return dense();
    }
    let reader = arguments[0].as_str();
    let (each, beside) = most(reader);
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("seeds").join(&arguments[0])];
    folders.extend(arguments[2..].iter().map(PathBuf::from));
    let seeds: Vec<Vec<u8>> = folders.iter().flat_map(|f| files(f)).filter_map(|f| std::fs::read(f).ok()).collect();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let (start, mut runs, mut sound, mut worst) = (Instant::now(), 0_u64, 0_u64, (0.0_f64, Duration::ZERO));
    while start.elapsed().as_secs() < seconds {
        let mut bytes = seeds[random.below(seeds.len())].clone();
        let other = &seeds[random.below(seeds.len())];
        mutate(&mut bytes, other, &mut random);
        let began = Instant::now();
        let result = std::panic::catch_unwind(|| peak(|| read_as(reader, &bytes)));
        let took = began.elapsed();
        let (taken, ok) = result.unwrap_or_else(|_| keep(&bytes, "panic"));
        if taken > each * bytes.len() + beside {
            keep(&bytes, &format!("{taken} bytes of memory for {}", bytes.len()));
        }
        if took > SLOWEST {
            keep(&bytes, &format!("{took:?}"));
        }
        (runs, sound) = (runs + 1, sound + u64::from(ok));
        worst = (worst.0.max(taken as f64 / (bytes.len() + beside / each) as f64), worst.1.max(took));
    }
    println!(
        "{}: {runs} files, {sound} of them sound; at most {:.1} bytes a byte and {:?}",
        arguments[0], worst.0, worst.1
    );
}

fn keep(bytes: &[u8], why: &str) -> ! {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("artifacts");
    let file = folder.join(format!(
        "mutate-{:x}",
        bytes.iter().fold(7_u64, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3))
    ));
    std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, bytes)).expect("the folder can be written to");
    println!("{why}: {}", file.display());
    std::process::exit(1);
}

/// Files of about a megabyte that take as much memory as they can.
fn dense() {
    let n = 1 << 20;
    let repeat = |head: &str, unit: &str, tail: &str| {
        format!("{head}{}{tail}", unit.repeat((n - head.len() - tail.len()) / unit.len())).into_bytes()
    };
    let three = "v 0 0 0\nv 0 1 0\nv 1 0 0\n";
    let distinct: String = (0..60_000).map(|i| format!(" 1/{}", i % 1000 + 1)).collect();
    let groups: String = (0..70_000).map(|i| format!("g {i:x}\nf 1 2 3\n")).collect();
    let glb = |json: &str, bin: &[u8]| {
        let mut json = json.as_bytes().to_vec();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
        out.extend((json.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(&json);
        out.extend((bin.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(bin);
        out
    };
    let ply = |vertices: usize, body: &[u8]| {
        let mut out = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty uchar x\nproperty uchar y\nproperty uchar z\n\
             element face {}\nproperty list uchar uchar vertex_indices\nend_header\n",
            body.len() / 256
        )
        .into_bytes();
        out.extend(vec![1; vertices * 3]);
        out.extend(body);
        out
    };
    let strip = |count: usize, primitives: &str| {
        format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{primitives}]}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}},{{"bufferView":0,"componentType":5121,"count":{count},"type":"SCALAR"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{count}}}],"buffers":[{{"byteLength":{count}}}]}}"#
        )
    };
    let one = r#"{"attributes":{"POSITION":0},"indices":1,"mode":5}"#;
    let json = |list: &str, unit: &str| {
        repeat(&format!("{{\"asset\":{{\"version\":\"2.0\"}},\"{list}\":[{unit}"), &format!(",{unit}"), "]}")
    };
    let polygons: Vec<u8> = (0..4096).flat_map(|_| std::iter::once(255).chain((0..255).map(|i| i as u8))).collect();
    let mtg = "CODE:\tFORM-A\nCLASSES:\nA 1\nMTG:\nENTITY-CODE\tLength\n/A1\t1\n";
    for (name, bytes) in [
        ("obj: one huge face", repeat(&format!("{three}f"), " 1", "\n")),
        ("obj: vertices", repeat("v 0 0 0\nf 1 1 1\n", "v 0 0 0\n", "")),
        ("obj: triangles", repeat(three, "f 1 2 3\n", "")),
        (
            "obj: corners of their own",
            repeat(&format!("{three}{}", "vt 0\n".repeat(1000)), &format!("f{distinct}\n"), ""),
        ),
        ("obj: groups", repeat(three, &groups, "")),
        (
            "obj: materials",
            [b"mtllib a.mtl\n".as_slice(), three.as_bytes(), b"f 1 2 3\n", PART, &repeat("", "newmtl\n", "")].concat(),
        ),
        ("ply: polygons", ply(256, &polygons)),
        ("ply: vertices", ply(n / 3, &[])),
        ("gltf: strip", glb(&strip(n, one), &vec![0; n])),
        ("gltf: one mesh over and over", glb(&strip(n, &vec![one; 100].join(",")), &vec![0; n])),
        ("gltf: nodes", json("nodes", "{}")),
        ("gltf: materials", json("materials", "{}")),
        ("gltf: meshes", json("meshes", "{}")),
        ("gltf: images", json("images", r#"{"uri":""}"#)),
        ("gltf: extensions", json("extensionsUsed", "\"\"")),
        ("swc", repeat("", "1 0 0 0 1 0\n", "")),
        ("cylinders", repeat("parent,radius,start_x,start_y,start_z,end_x,end_y,end_z\n", "0,1,0,0,0,0,0,1\n", "")),
        ("mtg", repeat(mtg, "^<A\t1\n", "")),
        ("mtg: without measures", repeat(mtg, "^<A\n", "")),
    ] {
        let (taken, sound) = peak(|| read(&bytes));
        println!(
            "{:<32} {:>8} bytes {:>6.1} bytes a byte {}",
            name,
            bytes.len(),
            taken as f64 / bytes.len() as f64,
            if sound { "read" } else { "refused" }
        );
    }
}
