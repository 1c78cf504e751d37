//! Address, token, host names and frame ancestors of the control interface, and their validation: beyond the loopback
//! it needs a token.
//!
//! The settings are enforced for each request in [`super::guard`].

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use std::str::FromStr;
use ts3100_proto::words::UnexpectedWord;

/// The default port.
pub const DEFAULT_PORT: u16 = 3_100;
/// Fewest characters of a token.
pub const MIN_TOKEN: usize = 16;
/// Schemes that name no application of their own: any page of the web can have them.
const WEB_SCHEMES: [&str; 8] = ["about", "blob", "data", "file", "http", "https", "ws", "wss"];

/// The flag `--control`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlChoice {
    /// No control interface.
    Off,
    /// There.
    Address(SocketAddr),
}

impl FromStr for ControlChoice {
    type Err = UnexpectedWord;

    /// `off`, `ADDR:PORT`, or a port of 127.0.0.1; port 0 is a free one.
    fn from_str(text: &str) -> Result<ControlChoice, UnexpectedWord> {
        let loopback = IpAddr::V4(Ipv4Addr::LOCALHOST);
        if text == "off" {
            return Ok(ControlChoice::Off);
        }
        let port = text.parse::<u16>().map(|port| SocketAddr::new(loopback, port));
        port.or_else(|_| text.parse())
            .map(ControlChoice::Address)
            .map_err(|_| UnexpectedWord::new("`off`, ADDRESS:PORT or a port of 127.0.0.1", text))
    }
}

/// Settings of the control interface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ControlSettings {
    /// Address to listen on; port 0 is a free one.
    pub address: SocketAddr,
    /// The bearer token; needed beyond the loopback, unless the interface is open.
    pub token: Option<String>,
    /// Without a token, every call is accepted: beyond the loopback, and under any host name.
    pub open: bool,
    /// Names besides those of the loopback by which it may be called.
    pub hosts: Vec<String>,
    /// Origins whose pages may show the pages of the interface in a frame; empty allows none.
    pub frame_ancestors: Vec<String>,
}

/// A setting that does not allow a control interface.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ControlError {
    /// Reachable from other machines without a token.
    #[error(
        "--control {0} can be reached from other machines: give a token with --control-token-file, \
         --control-token or TS3100_CONTROL_TOKEN, choose 127.0.0.1, or accept every call with --control-open"
    )]
    NoToken(SocketAddr),
    /// An invalid token.
    #[error("--control-token: expected at least {MIN_TOKEN} visible ASCII characters, found {0}")]
    Token(String),
    /// An invalid host name.
    #[error("--control-host: expected a name without scheme and port, found `{0}`")]
    Host(String),
    /// An invalid origin.
    #[error(
        "--control-frame-ancestor: expected SCHEME://HOST, SCHEME://HOST:PORT or the scheme of an editor such as \
         `vscode-webview:`, found `{0}`"
    )]
    FrameAncestor(String),
    /// The port does not exist.
    #[error(
        "--port-offset {0}: the control interface would be on port {DEFAULT_PORT} + {0}; use --control off or \
         --control ADDRESS:PORT"
    )]
    Offset(u16),
}

impl ControlSettings {
    /// On a free port of the loopback, without a token.
    pub fn free() -> ControlSettings {
        ControlSettings {
            address: SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0),
            token: None,
            open: false,
            hosts: Vec::new(),
            frame_ancestors: Vec::new(),
        }
    }

    /// Everybody who reaches the interface may use it: it is open and has no token.
    pub fn accepts_everybody(&self) -> bool {
        self.open && self.token.is_none()
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// See [`ControlError`].
    pub fn validate(self) -> Result<ControlSettings, ControlError> {
        if let Some(token) = &self.token {
            if token.len() < MIN_TOKEN {
                return Err(ControlError::Token(format!("{} characters", token.len())));
            }
            if !token.bytes().all(|byte| byte.is_ascii_graphic()) {
                return Err(ControlError::Token("a blank or another character".to_owned()));
            }
        } else if !self.open && !self.address.ip().to_canonical().is_loopback() {
            return Err(ControlError::NoToken(self.address));
        }
        if let Some(host) = self.hosts.iter().find(|host| !is_host_name(host)) {
            return Err(ControlError::Host(host.clone()));
        }
        match self.frame_ancestors.iter().find(|origin| !is_origin(origin)) {
            Some(origin) => Err(ControlError::FrameAncestor(origin.clone())),
            None => Ok(self),
        }
    }
}

fn is_host_name(host: &str) -> bool {
    let letter = |letter: char| letter.is_ascii_alphanumeric() || "-._".contains(letter);
    let address = host.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'));
    match address {
        Some(address) => address.parse::<Ipv6Addr>().is_ok(),
        None => !host.is_empty() && host.chars().all(letter),
    }
}

/// One origin, or the scheme of an editor, whose views have another host in each window. It becomes a part of a header:
/// nothing in it may end that part or match more than it names.
fn is_origin(text: &str) -> bool {
    let Some((scheme, rest)) = text.split_once(':') else {
        return false;
    };
    let letter = |letter: char| letter.is_ascii_alphanumeric() || "+-.".contains(letter);
    let is_scheme =
        scheme.starts_with(|first: char| first.is_ascii_alphabetic()) && scheme.chars().all(letter);
    if rest.is_empty() {
        return is_scheme && !WEB_SCHEMES.contains(&scheme.to_ascii_lowercase().as_str());
    }
    let Some(authority) = rest.strip_prefix("//") else {
        return false;
    };
    let (host, port) = match authority.rsplit_once(':') {
        Some((host, port)) if !port.ends_with(']') => (host, Some(port)),
        _ => (authority, None),
    };
    is_scheme && is_host_name(host) && port.is_none_or(|port| port.parse::<u16>().is_ok())
}
