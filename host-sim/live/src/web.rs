//! The page: its files, its events, and its buttons.
//!
//! A client that can send to this server could change a device, so:
//!
//! - Every request must name this server by an IP address, `localhost`, or a name that was given
//!   with `--host`. A page of another site that had its own name point here (DNS rebinding) is
//!   refused.
//! - An order must come from a page of this server (`Origin`), with the token that stands in it,
//!   as JSON. So no form and no script of another site can give one.
//! - The device's key stays in this program.

mod listening;

use crate::device::{Order, PendingOrder, Reply};
use crate::hub::Hub;
use axum::body::Body;
use axum::extract::rejection::JsonRejection;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, HOST, ORIGIN, REFERRER_POLICY,
    X_CONTENT_TYPE_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, StatusCode};
use axum::middleware::{self, Next};
use axum::response::sse::{self, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use listening::until_the_end;
use serde::Serialize;
use std::convert::Infallible;
use std::net::IpAddr;
use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use tokio::sync::{oneshot, watch};
use tokio_stream::{Stream, StreamExt};

/// Header with the page's token.
pub const TOKEN: &str = "x-live-token";
/// Longest order, bytes: a unit file with its comments is 20 kB.
const LONGEST: usize = 256 * 1024;

const PAGE: &str = include_str!("../assets/index.html");

/// The page's files: path, type, contents.
const FILES: [(&str, &str, &str); 10] = [
    ("/live.css", "text/css", include_str!("../assets/live.css")),
    (
        "/live.js",
        "text/javascript",
        include_str!("../assets/live.js"),
    ),
    (
        "/plots.js",
        "text/javascript",
        include_str!("../assets/plots.js"),
    ),
    (
        "/tables.js",
        "text/javascript",
        include_str!("../assets/tables.js"),
    ),
    (
        "/attitude.js",
        "text/javascript",
        include_str!("../assets/attitude.js"),
    ),
    (
        "/track.js",
        "text/javascript",
        include_str!("../assets/track.js"),
    ),
    (
        "/orders.js",
        "text/javascript",
        include_str!("../assets/orders.js"),
    ),
    (
        "/uplot.js",
        "text/javascript",
        include_str!("../assets/uplot/uPlot.iife.min.js"),
    ),
    (
        "/uplot.css",
        "text/css",
        include_str!("../assets/uplot/uPlot.min.css"),
    ),
    (
        "/uplot-license.txt",
        "text/plain",
        include_str!("../assets/uplot/LICENSE"),
    ),
];

/// State of the server.
#[derive(Clone)]
pub struct Server {
    /// Events for the pages.
    pub hub: Arc<Hub>,
    /// Receives the orders; `None`: the page has no buttons.
    pub orders: Option<SyncSender<PendingOrder>>,
    /// The page's token.
    pub token: Arc<str>,
    /// Names of this server beside IP addresses and `localhost`.
    pub names: Arc<[String]>,
    /// Becomes true when the server ends.
    pub ends: watch::Receiver<bool>,
}

impl Server {
    /// The routes.
    pub fn routes(self) -> Router {
        let mut routes = Router::new()
            .route("/", get(page))
            .route("/events", get(events))
            .route("/order", post(order).layer(DefaultBodyLimit::max(LONGEST)));
        for (path, kind, contents) in FILES {
            let kind = HeaderValue::from_static(kind);
            routes = routes.route(path, get(async move || ([(CONTENT_TYPE, kind)], contents)));
        }
        let guard = middleware::from_fn_with_state(self.clone(), named);
        routes.layer(guard).with_state(self)
    }

    /// Whether `host`, with or without a port, is a name of this server.
    fn is(&self, host: &str) -> bool {
        let name = match host.rsplit_once(':') {
            Some((name, port)) if port.bytes().all(|b| b.is_ascii_digit()) => name,
            _ => host,
        };
        let bare = name.trim_start_matches('[').trim_end_matches(']');
        bare.parse::<IpAddr>().is_ok()
            || name.eq_ignore_ascii_case("localhost")
            || self
                .names
                .iter()
                .any(|known| known.eq_ignore_ascii_case(name))
    }

    /// Checks that an order comes from this server's own page; the error says why not.
    fn own(&self, headers: &HeaderMap) -> Result<(), &'static str> {
        let text = |name: &_| headers.get(name).and_then(|value| value.to_str().ok());
        let host = text(&HOST).unwrap_or_default();
        if text(&ORIGIN) != Some(&format!("http://{host}")) {
            return Err("the order comes from another site");
        }
        let token = headers.get(TOKEN).map(HeaderValue::as_bytes);
        if !token.is_some_and(|token| same(token, self.token.as_bytes())) {
            return Err("the page is of an earlier start of this program; load it again");
        }
        Ok(())
    }
}

/// Compares in constant time, so that the time does not show the first difference.
fn same(a: &[u8], b: &[u8]) -> bool {
    a.len() == b.len() && a.iter().zip(b).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}

/// Refuses requests for another server, and sends browsers the page's permissions.
async fn named(State(server): State<Server>, request: Request, next: Next) -> Response {
    let host = request.headers().get(HOST).and_then(|of| of.to_str().ok());
    let mut response = if host.is_some_and(|host| server.is(host)) {
        next.run(request).await
    } else {
        let why = "this name of the server is not known; remedy: give --host NAME\n";
        (StatusCode::FORBIDDEN, why).into_response()
    };
    let headers = response.headers_mut();
    for (name, value) in [
        (
            CONTENT_SECURITY_POLICY,
            "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'; \
             base-uri 'none'; form-action 'none'",
        ),
        (X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (REFERRER_POLICY, "no-referrer"),
        (CACHE_CONTROL, "no-store"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    response
}

async fn page(State(server): State<Server>) -> Response {
    let buttons = if server.orders.is_some() { "yes" } else { "no" };
    let text = PAGE
        .replace("{{token}}", &server.token)
        .replace("{{buttons}}", buttons);
    let kind = HeaderValue::from_static("text/html; charset=utf-8");
    ([(CONTENT_TYPE, kind)], Body::from(text)).into_response()
}

/// All events of the hub, as server-sent events, until the server ends.
async fn events(
    State(server): State<Server>,
) -> Sse<impl Stream<Item = Result<sse::Event, Infallible>>> {
    let (first, receiver) = server.hub.listen();
    let first = tokio_stream::iter(first);
    let rest = until_the_end(receiver, server.ends.clone());
    let all = first
        .chain(rest)
        .map(|event| Ok(sse::Event::default().event(event.name).data(&*event.json)));
    Sse::new(all).keep_alive(KeepAlive::default())
}

/// Answer to an order.
#[derive(Serialize)]
struct Answer {
    done: bool,
    says: String,
}

fn answer(status: StatusCode, reply: Reply) -> Response {
    let done = reply.is_ok();
    let says = reply.unwrap_or_else(|why| why);
    (status, Json(Answer { done, says })).into_response()
}

async fn order(
    State(server): State<Server>,
    headers: HeaderMap,
    order: Result<Json<Order>, JsonRejection>,
) -> Response {
    if let Err(why) = server.own(&headers) {
        return answer(StatusCode::FORBIDDEN, Err(why.into()));
    }
    let Some(orders) = &server.orders else {
        let why = "this page only shows; remedy: start with --orders".to_owned();
        return answer(StatusCode::FORBIDDEN, Err(why));
    };
    let order = match order {
        Ok(Json(order)) => order,
        Err(why) => return answer(why.status(), Err(why.body_text())),
    };
    let (reply, done) = oneshot::channel();
    match orders.try_send(PendingOrder { order, reply }) {
        Ok(()) => {}
        Err(TrySendError::Full(_) | TrySendError::Disconnected(_)) => {
            let why = "other orders wait; remedy: try again".to_owned();
            return answer(StatusCode::SERVICE_UNAVAILABLE, Err(why));
        }
    }
    match done.await {
        Ok(Ok(says)) => answer(StatusCode::OK, Ok(says)),
        Ok(Err(why)) => answer(StatusCode::CONFLICT, Err(why)),
        Err(_) => answer(
            StatusCode::SERVICE_UNAVAILABLE,
            Err("the server ends".into()),
        ),
    }
}
