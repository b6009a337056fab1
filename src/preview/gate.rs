//! Who may ask for what: checked before a request is looked at any further.
//!
//! A page that runs on this machine can be reached by every other page in the user's browser. Three things keep those
//! out: the `Host` must be this server by name of the loopback or by number (a name that somebody points at 127.0.0.1,
//! DNS rebinding, is neither); an `Origin`, which browsers send with what other pages cause, must be this server; and
//! what changes anything must say it is JSON, which no form of another page can without asking first, and is never
//! allowed.

use std::net::{IpAddr, SocketAddr};

/// Longest path with its query, bytes.
pub(super) const LONGEST_PATH: usize = 1024;

/// Why a request is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// It is for somebody else.
    Host,
    /// Another page caused it.
    Origin,
    /// It changes something and is no JSON.
    Form,
    /// Its path is too long.
    Long,
    /// Neither GET, HEAD nor POST.
    Method,
}

impl Refusal {
    /// The status and a sentence.
    #[must_use]
    pub(super) const fn told(self) -> (u16, &'static str) {
        match self {
            Self::Host => (421, "this server answers to localhost and to its number only"),
            Self::Origin => (403, "another page may not ask this server"),
            Self::Form => (415, "send JSON"),
            Self::Long => (414, "the path is too long"),
            Self::Method => (405, "GET and POST only"),
        }
    }
}

/// What of a request the gate looks at.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Asked<'a> {
    /// `GET`, …
    pub(super) method: &'a str,
    /// Path and query.
    pub(super) path: &'a str,
    /// All `Host` headers.
    pub(super) hosts: &'a [&'a str],
    /// All `Origin` headers.
    pub(super) origins: &'a [&'a str],
    /// `Sec-Fetch-Site`.
    pub(super) site: Option<&'a str>,
    /// `Content-Type`.
    pub(super) content: Option<&'a str>,
}

/// Whether a request may go on to a server that listens at `here`.
///
/// # Errors
///
/// The first reason why not.
pub(super) fn pass(asked: &Asked<'_>, here: SocketAddr) -> Result<(), Refusal> {
    if !matches!(asked.method, "GET" | "HEAD" | "POST") {
        return Err(Refusal::Method);
    }
    if asked.path.len() > LONGEST_PATH {
        return Err(Refusal::Long);
    }
    let [host] = asked.hosts else { return Err(Refusal::Host) };
    if !is_here(host, here) {
        return Err(Refusal::Host);
    }
    let own = |origin: &&str| origin.strip_prefix("http://").is_some_and(|name| name.eq_ignore_ascii_case(host));
    if !asked.origins.iter().all(own) || asked.origins.len() > 1 {
        return Err(Refusal::Origin);
    }
    if asked.site.is_some_and(|site| !matches!(site, "same-origin" | "none")) {
        // Following a link to the page itself is no harm; it shows nothing to who linked.
        if asked.method == "POST" || asked.path != "/" {
            return Err(Refusal::Origin);
        }
    }
    let json = |content: &str| content.split(';').next().is_some_and(|c| c.trim() == "application/json");
    if asked.method == "POST" && !asked.content.is_some_and(json) {
        return Err(Refusal::Form);
    }
    Ok(())
}

/// Whether a `Host` names a server that listens at `here`.
fn is_here(host: &str, here: SocketAddr) -> bool {
    let (name, port) = match host.rsplit_once(':') {
        Some((name, port)) if !port.ends_with(']') => (name, port.parse::<u16>().ok()),
        _ => (host, Some(80)),
    };
    if port != Some(here.port()) {
        return false;
    }
    if name.eq_ignore_ascii_case("localhost") {
        return here.ip().is_loopback() || here.ip().is_unspecified();
    }
    let number = name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name);
    match number.parse::<IpAddr>() {
        // A number can't be rebound.
        Ok(ip) => ip == here.ip() || here.ip().is_unspecified() || (ip.is_loopback() && here.ip().is_loopback()),
        Err(_) => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HERE: &str = "127.0.0.1:8750";

    fn tried(change: impl FnOnce(&mut Asked<'static>)) -> Result<(), Refusal> {
        let mut asked = Asked { method: "GET", path: "/api/state", hosts: &[HERE], ..Asked::default() };
        change(&mut asked);
        pass(&asked, HERE.parse().unwrap())
    }

    #[test]
    fn only_this_servers_own_page_passes() {
        assert_eq!(tried(|_| {}), Ok(()));
        assert_eq!(tried(|a| a.hosts = &["localhost:8750"]), Ok(()));
        assert_eq!(tried(|a| a.origins = &["http://127.0.0.1:8750"]), Ok(()));
        for hosts in [
            &["evil.example:8750"] as &[&str],
            &["127.0.0.1"],
            &["127.0.0.1:80"],
            &["127.0.0.1:8750.evil.example"],
            &["localhost.evil.example:8750"],
            &["127.0.0.1:8750", "127.0.0.1:8750"],
            &[""],
            &[],
            &["192.168.0.2:8750"],
        ] {
            assert_eq!(tried(|a| a.hosts = hosts), Err(Refusal::Host), "{hosts:?}");
        }
        for origins in
            [&["http://evil.example"] as &[&str], &["null"], &["https://127.0.0.1:8750"], &["http://127.0.0.1:87500"]]
        {
            assert_eq!(tried(|a| a.origins = origins), Err(Refusal::Origin), "{origins:?}");
        }
        assert_eq!(tried(|a| a.site = Some("cross-site")), Err(Refusal::Origin));
        assert_eq!(tried(|a| (a.site, a.path) = (Some("cross-site"), "/")), Ok(()));
    }

    #[test]
    fn what_changes_something_is_json_of_the_page() {
        let post = |content| tried(|a| (a.method, a.content) = ("POST", content));
        assert_eq!(post(Some("application/json; charset=utf-8")), Ok(()));
        for content in [None, Some("text/plain"), Some("application/x-www-form-urlencoded"), Some("application/jsonx")]
        {
            assert_eq!(post(content), Err(Refusal::Form));
        }
        assert_eq!(tried(|a| a.method = "DELETE"), Err(Refusal::Method));
        let long: &'static str = Box::leak("a".repeat(LONGEST_PATH + 1).into_boxed_str());
        assert_eq!(tried(|a| a.path = long), Err(Refusal::Long));
    }

    #[test]
    fn who_listens_to_all_answers_to_numbers_and_to_no_name() {
        let here = "0.0.0.0:8750".parse().unwrap();
        let asked = |host| pass(&Asked { method: "GET", path: "/", hosts: &[host], ..Asked::default() }, here);
        assert_eq!(asked("192.168.0.2:8750"), Ok(()));
        assert_eq!(asked("[::1]:8750"), Ok(()));
        assert_eq!(asked("tree.example:8750"), Err(Refusal::Host));
    }
}
