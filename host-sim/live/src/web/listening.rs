//! The hub's events as a stream.

use crate::hub::Event;
use tokio::sync::broadcast::Receiver;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{mpsc, watch};
use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;

/// Events until the server ends or the page is closed. A page that is too slow misses events.
pub(super) fn until_the_end(
    mut events: Receiver<Event>,
    mut ends: watch::Receiver<bool>,
) -> impl Stream<Item = Event> {
    // one event waits here, all others in the hub's ring
    let (sender, receiver) = mpsc::channel(1);
    tokio::spawn(async move {
        loop {
            let event = tokio::select! {
                event = events.recv() => event,
                _ = ends.changed() => return,
            };
            match event {
                Ok(event) => {
                    let sent = tokio::select! {
                        sent = sender.send(event) => sent.is_ok(),
                        _ = ends.changed() => false,
                    };
                    if !sent {
                        return;
                    }
                }
                Err(RecvError::Lagged(_)) => {}
                Err(RecvError::Closed) => return,
            }
        }
    });
    ReceiverStream::new(receiver)
}
