//! What is answered to what: a thin layer over the hub. Names are looked up in lists, never joined to paths as they
//! come.

use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, to_bytes};
use axum::extract::{Path, Query, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use tokio::sync::Semaphore;

use super::desk::{self, Decide, Drawn as Crown, Refused, Save};
use super::drafts::Draft;
use super::gate::{self, Asked, Refusal};
use super::hub::{Hub, Shot};
use super::project::ErrorView;
use super::{pages, turntable};
use crate::base::Diagnostic;
use crate::build::{Loaded, load_edited};

/// Largest body of a request, bytes.
const LARGEST: usize = 1 << 20;
/// Works at a time; each uses all cores while it can.
const WORKERS: usize = 3;

/// What a browser is told about every answer: nothing of it is for other pages, and nothing comes from elsewhere.
const HEADERS: [(&str, &str); 6] = [
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob:; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-resource-policy", "same-origin"),
    ("cross-origin-opener-policy", "same-origin"),
    ("x-frame-options", "DENY"),
];

/// What all routes share.
#[derive(Clone)]
pub(super) struct Shared {
    pub(super) hub: Arc<Hub>,
    work: Arc<Semaphore>,
    address: SocketAddr,
    /// How long a body may take.
    patience: Duration,
}

/// All routes, behind the gate.
pub(super) fn router(hub: Arc<Hub>, address: SocketAddr, patience: Duration) -> Router {
    let shared = Shared { hub, work: Arc::new(Semaphore::new(WORKERS)), address, patience };
    Router::new()
        .route("/", get(|| async { page("index.html") }))
        .route("/page/{file}", get(|Path(file): Path<String>| async move { page(&file) }))
        .route("/three/{file}", get(three))
        .route("/api/state", get(state))
        .route("/api/events", get(events))
        .route("/api/knobs", get(knobs))
        .route("/api/draft", post(draft))
        .route("/api/save", post(save))
        .route("/api/decide", post(decide))
        .route("/api/sketch", post(sketch))
        .route("/set/{set}/{file}", get(set_file))
        .route("/picture/{set}/{variant}", get(picture))
        .fallback(|| async { refused(404, "there is nothing here") })
        .layer(middleware::from_fn_with_state(shared.clone(), guard))
        .with_state(shared)
}

/// Lets through what may pass, and labels every answer.
async fn guard(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    let mut response = match verdict(&request, shared.address) {
        Ok(()) => next.run(request).await,
        Err(refusal) => {
            let (status, why) = refusal.told();
            refused(status, why)
        }
    };
    for (name, value) in HEADERS {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response.headers_mut().entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-cache"));
    response
}

/// What the gate says of a request.
fn verdict(request: &Request, address: SocketAddr) -> Result<(), Refusal> {
    let text = |value: &HeaderValue| value.to_str().unwrap_or("?").to_owned();
    let all = |name: HeaderName| request.headers().get_all(name).iter().map(text).collect::<Vec<String>>();
    let one = |name: &str| request.headers().get(name).map(text);
    let (site, content) = (one("sec-fetch-site"), one("content-type"));
    let (hosts, origins) = (all(header::HOST), all(header::ORIGIN));
    let asked = Asked {
        method: request.method().as_str(),
        path: request.uri().path_and_query().map_or("", |p| p.as_str()),
        hosts: &hosts.iter().map(String::as_str).collect::<Vec<_>>(),
        origins: &origins.iter().map(String::as_str).collect::<Vec<_>>(),
        site: site.as_deref(),
        content: content.as_deref(),
    };
    gate::pass(&asked, address)
}

/// An error as people read it.
pub(super) fn refused(status: u16, why: &str) -> Response {
    let status = StatusCode::from_u16(status).unwrap_or(StatusCode::BAD_REQUEST);
    (status, [(header::CONTENT_TYPE, "text/plain; charset=utf-8")], why.to_owned()).into_response()
}

fn typed(kind: &'static str, body: impl Into<Body>) -> Response {
    ([(header::CONTENT_TYPE, kind)], body.into()).into_response()
}

/// JSON.
pub(super) fn json(value: &serde_json::Value) -> Response {
    typed("application/json", value.to_string())
}

fn page(name: &str) -> Response {
    pages::file(name).map_or_else(|| refused(404, "the page has no such file"), |(kind, text)| typed(kind, text))
}

async fn three(State(shared): State<Shared>, Path(file): Path<String>) -> Response {
    let text = shared.hub.three.as_ref().and_then(|three| three.file(&file));
    text.map_or_else(|| refused(404, "three.js is not here"), |text| typed("text/javascript; charset=utf-8", text))
}

async fn state(State(shared): State<Shared>) -> Response {
    let state = shared.hub.project().state();
    json(&state)
}

async fn events(State(shared): State<Shared>) -> Response {
    match shared.hub.listeners.join() {
        Some(heard) => typed("text/event-stream", Body::new(heard)),
        None => refused(503, "too many pages listen"),
    }
}

/// Does what takes time aside; no more at a time than the machine can bear.
pub(super) async fn aside<T: Send + 'static>(
    shared: &Shared,
    work: impl FnOnce(&Hub) -> T + Send + 'static,
) -> Option<T> {
    let turn = shared.work.clone().acquire_owned().await.ok()?;
    let hub = shared.hub.clone();
    tokio::task::spawn_blocking(move || {
        let made = work(&hub);
        drop(turn);
        made
    })
    .await
    .ok()
}

/// The body of a request; an answer where it is too large or takes too long.
pub(super) async fn body(shared: &Shared, request: Request) -> Result<Vec<u8>, Response> {
    match tokio::time::timeout(shared.patience, to_bytes(request.into_body(), LARGEST)).await {
        Ok(Ok(bytes)) => Ok(bytes.to_vec()),
        Ok(Err(_)) => Err(refused(413, "at most 1 MiB are read")),
        Err(_) => Err(refused(408, "the request took too long")),
    }
}

async fn set_file(
    State(shared): State<Shared>,
    Path((set, file)): Path<(String, String)>,
    headers: HeaderMap,
) -> Response {
    let nothing = || refused(404, "no set has such a file");
    let Some((manifest, folder)) = shared.hub.project().set(&set) else { return nothing() };
    let Some(entry) = manifest.files.iter().find(|entry| entry.file == file && !file.contains(['/', '\\'])) else {
        return nothing();
    };
    let tag = format!("\"{}\"", &entry.blake3.get(..32).unwrap_or("?"));
    if headers.get(header::IF_NONE_MATCH).is_some_and(|known| known.as_bytes() == tag.as_bytes()) {
        return (StatusCode::NOT_MODIFIED, [(header::ETAG, tag)]).into_response();
    }
    let path = folder.join(&entry.file);
    let most = entry.bytes;
    let read = aside(&shared, move |_| {
        // A link in the folder of sets could lead anywhere.
        let inside = path.canonicalize().ok()?.starts_with(folder.canonicalize().ok()?);
        let fits =
            std::fs::metadata(&path).is_ok_and(|m| m.is_file() && m.len() <= most.saturating_mul(2).max(1 << 20));
        (inside && fits).then(|| std::fs::read(path).ok()).flatten()
    })
    .await
    .flatten();
    let Some(bytes) = read else { return nothing() };
    let kind = match file.rsplit('.').next() {
        Some("png") => "image/png",
        Some("glb") => "model/gltf-binary",
        Some("json") => "application/json",
        _ => "application/octet-stream",
    };
    let mut response = typed(kind, bytes);
    if let Ok(tag) = HeaderValue::from_str(&tag) {
        response.headers_mut().insert(header::ETAG, tag);
    }
    response
}

#[derive(Debug, Deserialize)]
struct Drawn {
    level: Option<usize>,
    #[serde(default)]
    turn: i32,
    #[serde(default = "usual_edge")]
    width: u32,
    #[serde(default = "usual_edge")]
    height: u32,
}

const fn usual_edge() -> u32 {
    256
}

async fn picture(
    State(shared): State<Shared>,
    Path((set, variant)): Path<(String, usize)>,
    Query(drawn): Query<Drawn>,
) -> Response {
    let edge = |edge: u32| edge.clamp(turntable::EDGES.0, turntable::EDGES.1);
    let shot = Shot {
        level: drawn.level,
        turn: drawn.turn.rem_euclid(360),
        width: edge(drawn.width),
        height: edge(drawn.height),
    };
    match aside(&shared, move |hub| hub.picture(&set, variant, shot)).await.flatten() {
        Some(png) => typed("image/png", png.to_vec()),
        None => refused(404, "there is no such variant"),
    }
}

/// What a request asks, as JSON.
async fn asked<T: DeserializeOwned>(shared: &Shared, request: Request) -> Result<T, Response> {
    let bytes = body(shared, request).await?;
    serde_json::from_slice(&bytes)
        .map_err(|error| refused(400, &format!("this is not what is asked for here: {error}")))
}

/// Errors of presets as JSON.
fn wrong(hub: &Hub, errors: &[Diagnostic]) -> Response {
    let folder = hub.project().folder.clone();
    let shown: Vec<ErrorView> = errors.iter().take(20).map(|error| ErrorView::of(error, &folder)).collect();
    let message = errors.first().map(ToString::to_string).unwrap_or_default();
    let mut response = json(&serde_json::json!({ "message": message, "errors": shown }));
    *response.status_mut() = StatusCode::UNPROCESSABLE_ENTITY;
    response
}

/// Why nothing was written, as an answer.
fn told(hub: &Hub, why: &Refused) -> Response {
    match why {
        Refused::Stale => refused(409, "the file or the set has changed meanwhile; look again"),
        Refused::NoFile => refused(403, "this is no file that the page may read or write"),
        Refused::Wrong(sentence) => refused(422, sentence),
        Refused::Broken(errors) => wrong(hub, errors),
    }
}

/// Reads a preset by its file's name, does something with it aside, and answers.
async fn with_preset(
    shared: &Shared,
    file: String,
    work: impl FnOnce(&Hub, &std::path::Path, &Loaded) -> Result<serde_json::Value, Refused> + Send + 'static,
) -> Response {
    let answer = aside(shared, move |hub| {
        let (path, folder) = {
            let project = hub.project();
            (project.preset(&file), project.folder.clone())
        };
        let Some(path) = path else { return refused(404, "there is no such preset") };
        match load_edited(&path, &hub.limits, std::collections::BTreeMap::new()) {
            Ok(loaded) => match work(hub, &folder, &loaded) {
                Ok(value) => json(&value),
                Err(why) => told(hub, &why),
            },
            Err(errors) => wrong(hub, &errors),
        }
    });
    answer.await.unwrap_or_else(|| refused(500, "it went wrong"))
}

#[derive(Debug, Deserialize)]
struct KnobsQuery {
    preset: String,
    file: Option<String>,
}

async fn knobs(State(shared): State<Shared>, Query(query): Query<KnobsQuery>) -> Response {
    let KnobsQuery { preset, file } = query;
    let file = file.unwrap_or_else(|| preset.clone());
    with_preset(&shared, preset, move |_, folder, loaded| desk::knobs_of(folder, loaded, &file)).await
}

async fn save(State(shared): State<Shared>, request: Request) -> Response {
    match asked::<Save>(&shared, request).await {
        Ok(asked) => {
            with_preset(&shared, asked.preset.clone(), move |hub, folder, loaded| {
                desk::save(folder, loaded, &hub.limits, &asked)
            })
            .await
        }
        Err(response) => response,
    }
}

async fn decide(State(shared): State<Shared>, request: Request) -> Response {
    match asked::<Decide>(&shared, request).await {
        Ok(asked) => {
            with_preset(&shared, asked.preset.clone(), move |hub, folder, loaded| {
                let set = hub.project().set(&loaded.plan.name).ok_or(Refused::Stale)?;
                desk::decide(folder, loaded, &hub.limits, &set.0, &asked)
            })
            .await
        }
        Err(response) => response,
    }
}

async fn sketch(State(shared): State<Shared>, request: Request) -> Response {
    match asked::<Crown>(&shared, request).await {
        Ok(asked) => {
            with_preset(&shared, asked.preset.clone(), move |hub, folder, loaded| {
                desk::draw(folder, loaded, &hub.limits, &asked)
            })
            .await
        }
        Err(response) => response,
    }
}

/// JSON in letters that the head of an answer takes.
fn ascii(json: &str) -> String {
    let mut written = String::with_capacity(json.len());
    for letter in json.chars() {
        if letter.is_ascii() && !letter.is_ascii_control() {
            written.push(letter);
        } else {
            let units =
                letter.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect::<String>();
            written.push_str(&units);
        }
    }
    written
}

async fn draft(State(shared): State<Shared>, request: Request) -> Response {
    let draft = match asked::<Draft>(&shared, request).await {
        Ok(draft) => draft,
        Err(response) => return response,
    };
    let made = aside(&shared, move |hub| {
        let path = hub.project().preset(&draft.preset);
        let Some(path) = path else { return refused(404, "there is no such preset") };
        match hub.workshop.draw(&path, &draft) {
            Ok((png, facts)) => {
                let mut response = typed("image/png", png);
                let facts = serde_json::to_string(&facts).map_or_else(|_| String::new(), |facts| ascii(&facts));
                if let Ok(facts) = HeaderValue::from_str(&facts) {
                    response.headers_mut().insert("x-treewright", facts);
                }
                response
            }
            Err(errors) => wrong(hub, &errors),
        }
    });
    made.await.unwrap_or_else(|| refused(500, "it went wrong"))
}

#[cfg(test)]
mod tests {
    use super::ascii;

    #[test]
    fn facts_travel_in_the_head_of_an_answer_whatever_sources_are_called() {
        let told = serde_json::json!({ "notes": ["Bäume: 2 branches 🌳\u{7f}shed\n"] }).to_string();
        let sent = ascii(&told);
        assert!(sent.bytes().all(|b| (0x20..0x7f).contains(&b)), "{sent}");
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&sent).unwrap(),
            serde_json::from_str::<serde_json::Value>(&told).unwrap()
        );
    }
}
