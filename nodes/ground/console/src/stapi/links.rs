//! Links of STAPI's answers, and which product there is.

use axum::http::HeaderMap;

use super::models::PRODUCT;
use crate::problem::Problem;
use crate::server::Server;

/// The door of those who come this way, as the trail tells it.
pub const DOOR: &str = "stapi";

/// Makes absolute links, as the specification wants them.
pub struct Links(pub String);

impl Links {
    /// For who asks.
    #[must_use]
    pub fn of(server: &Server, headers: &HeaderMap) -> Self {
        Self(format!("{}/stapi", server.site.guard.base(headers)))
    }

    /// To a path of the API.
    #[must_use]
    pub fn to(&self, path: &str) -> String {
        format!("{}{path}", self.0)
    }

    /// To a path of the product.
    #[must_use]
    pub fn product(&self, path: &str) -> String {
        format!("{}/products/{PRODUCT}{path}", self.0)
    }
}

/// Texts as lists of answers have them.
#[must_use]
pub fn owned(texts: &[&str]) -> Vec<String> {
    texts.iter().map(|text| (*text).to_owned()).collect()
}

/// Whether there is such a product.
///
/// # Errors
/// When there is none.
pub fn known(product: &str) -> Result<(), Problem> {
    if product == PRODUCT { Ok(()) } else { Err(Problem::unknown(format!("there is no product {product:?}"))) }
}
