//! The files that the binary carries. They are compressed by the build script and leave so, if the client takes it.

use axum::body::Body;
use axum::http::header::{ACCEPT_ENCODING, CONTENT_ENCODING};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse as _, Response};
use flate2::read::GzDecoder;
use std::io::Read as _;

/// A file of `assets`, compressed with gzip.
pub struct Asset(pub &'static [u8]);

/// The file of this name.
macro_rules! asset {
    ($name:literal) => {
        $crate::asset::Asset(include_bytes!(concat!(env!("OUT_DIR"), "/", $name, ".gz")))
    };
}
pub(crate) use asset;

impl Asset {
    /// Its text.
    pub fn text(&self) -> String {
        let mut text = String::new();
        // The build script has made it of a text: there is nothing to report to whoever asks.
        let _ = GzDecoder::new(self.0).read_to_string(&mut text);
        text
    }

    /// The response, compressed if the request accepts that.
    pub fn response(&self, request: &HeaderMap) -> Response {
        let accepted = request.get_all(ACCEPT_ENCODING).iter();
        if !accepted.filter_map(|value| value.to_str().ok()).any(accepts_gzip) {
            return Body::from(self.text()).into_response();
        }
        let mut response = Body::from(self.0).into_response();
        let gzip = HeaderValue::from_static("gzip");
        response.headers_mut().insert(CONTENT_ENCODING, gzip);
        response
    }
}

/// Whether a value of `Accept-Encoding` has gzip, and not with the weight 0.
fn accepts_gzip(value: &str) -> bool {
    value.split(',').any(|coding| {
        let mut parts = coding.split(';').map(str::trim);
        let gzip = parts
            .next()
            .is_some_and(|name| name.eq_ignore_ascii_case("gzip") || name == "*");
        let refused = |part: &str| {
            let weight = part.strip_prefix("q=").map(str::parse::<f32>);
            weight.is_some_and(|weight| weight == Ok(0.0))
        };
        gzip && !parts.any(refused)
    })
}

#[cfg(test)]
mod tests {
    use super::accepts_gzip;

    #[test]
    fn gzip_is_accepted_unless_its_weight_is_zero() {
        for value in ["gzip", "gzip, deflate, br", "br;q=1.0, GZIP;q=0.8", "*"] {
            assert!(accepts_gzip(value), "{value}");
        }
        for value in ["", "identity", "br", "gzip;q=0", "gzip; q=0.0, br"] {
            assert!(!accepts_gzip(value), "{value}");
        }
    }
}
