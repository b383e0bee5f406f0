//! Starts and ends all parts of the server.

use crate::device::{Channels, Device};
use crate::hub::Hub;
use crate::options::Options;
use crate::record::Record;
use crate::taps::{Side, Taps};
use crate::web::Server;
use host_core::error::Error;
use host_device::device::read_key;
use host_device::hil::simulated::Simulated;
use host_sim::cli::stdout;
use std::io;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::sync_channel;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tokio::sync::watch;

/// Number of orders that may wait.
const WAITING: usize = 4;
/// Time for the pages to receive that the server ends.
const FAREWELL: Duration = Duration::from_secs(2);

/// Ports of the device: command link, stream, sensor.
type Ports = (String, Option<String>, Option<String>);

/// Runs until Ctrl-C.
///
/// # Errors
/// A port or file is not available; there is no device; the recording cannot be finished.
pub fn serve(options: &Options) -> Result<(), Error> {
    let stop = Arc::new(AtomicBool::new(false));
    let listener = listen(options.listen)?;
    let record = Arc::new(Record::default());
    let mut threads = Vec::new();
    let (command, stream, sensor) = ports(options, &stop, &mut threads)?;
    let device = Device {
        port: command,
        baud: options.baud,
        key: options.key.as_deref().map(read_key).transpose()?,
    };
    let link = device.open()?;
    let foxglove = options.foxglove.map(|at| record.serve(at)).transpose()?;
    options
        .mcap
        .as_deref()
        .map_or(Ok(()), |file| record.begin(file))?;
    let hub = Arc::new(Hub::default());
    let taps = Taps::new(&hub, &record, &stop, sensor.is_some());
    for (side, option, port) in [
        (Side::Corrected, "--stream", stream),
        (Side::Raw, "--sensor", sensor),
    ] {
        if let Some(port) = port {
            let taps = Arc::clone(&taps);
            threads.push(thread::spawn(move || taps.listen(side, option, &port)));
        }
    }
    let shown = Arc::clone(&taps);
    threads.push(thread::spawn(move || shown.show()));
    let (orders, given) = sync_channel(WAITING);
    let channels = Channels {
        hub: Arc::clone(&hub),
        taps,
        record: Arc::clone(&record),
        orders: given,
        stop: Arc::clone(&stop),
    };
    let keeps = orders.clone(); // the device is watched also by a page without buttons
    threads.push(thread::spawn(move || {
        device.watch(Some(link), &channels);
        drop(keeps);
    }));
    let web = Web {
        hub,
        orders: options.has_orders().then_some(orders),
        names: options.host.clone().into(),
    };
    let served = web.until_interrupted(listener, foxglove.as_ref().map(|of| of.port()));
    stop.store(true, Ordering::Relaxed);
    for thread in threads {
        let _ = thread.join();
    }
    if let Some(foxglove) = foxglove {
        foxglove.stop().wait_blocking();
    }
    record.end()?;
    served
}

/// Ports of the device; starts the simulated one.
fn ports(
    options: &Options,
    stop: &Arc<AtomicBool>,
    threads: &mut Vec<JoinHandle<()>>,
) -> Result<Ports, Error> {
    if let Some(device) = &options.device {
        return Ok((
            device.clone(),
            options.stream.clone(),
            options.sensor.clone(),
        ));
    }
    let any = ([127, 0, 0, 1], 0).into();
    let simulated = Simulated::new(&options.simulated.simulation(any)?)?;
    let [command, stream] = simulated.ports.clone();
    let stop = Arc::clone(stop);
    threads.push(thread::spawn(move || simulated.run(&stop, &mut |_| {})));
    Ok((command, Some(stream), None))
}

fn listen(at: SocketAddr) -> Result<TcpListener, Error> {
    let listener = TcpListener::bind(at).and_then(|listener| {
        listener.set_nonblocking(true)?;
        Ok(listener)
    });
    listener.map_err(|error| refused(at, &error))
}

fn refused(at: SocketAddr, error: &io::Error) -> Error {
    Error::Option {
        option: format!("--listen {at}"),
        problem: format!("cannot be had ({error})"),
        remedy: "end the program that has the port, or give --listen ADDRESS:PORT; port 0 is any \
                 that is free"
            .into(),
    }
}

/// State of the page's server.
struct Web {
    hub: Arc<Hub>,
    orders: Option<std::sync::mpsc::SyncSender<crate::device::PendingOrder>>,
    names: Arc<[String]>,
}

impl Web {
    /// Serves the page until Ctrl-C.
    fn until_interrupted(self, listener: TcpListener, foxglove: Option<u16>) -> Result<(), Error> {
        let at = listener.local_addr();
        let at = at.map_err(|error| refused(([0, 0, 0, 0], 0).into(), &error))?;
        let failed = |error: io::Error| refused(at, &error);
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build()
            .map_err(failed)?;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).map_err(failed)?;
            let (end, ends) = watch::channel(false);
            let server = Server {
                hub: self.hub,
                orders: self.orders,
                token: token()?.into(),
                names: self.names,
                ends,
            };
            let interrupted = interruption().map_err(failed)?;
            announce(at, foxglove)?;
            let quit = async move {
                interrupted.await;
                let _ = end.send(true);
            };
            let served = axum::serve(listener, server.routes()).with_graceful_shutdown(quit);
            served.await.map_err(failed)
        });
        runtime.shutdown_timeout(FAREWELL);
        served
    }
}

/// Prints the address of the page. The reader may be gone.
fn announce(at: SocketAddr, foxglove: Option<u16>) -> Result<(), Error> {
    stdout::print(format_args!(
        "the page is at http://{at}/ (Ctrl-C ends it)\n"
    ));
    if let Some(port) = foxglove {
        let ip = at.ip();
        stdout::print(format_args!("Foxglove and Lichtblick: ws://{ip}:{port}\n"));
    }
    stdout::finish()
}

/// Ends at Ctrl-C, or at a request of the system to end. From this call on neither kills the
/// program.
#[cfg(unix)]
fn interruption() -> io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut by_hand = signal(SignalKind::interrupt())?;
    let mut asked = signal(SignalKind::terminate())?;
    Ok(async move {
        tokio::select! {
            _ = by_hand.recv() => {}
            _ = asked.recv() => {}
        }
    })
}

/// Ends at Ctrl-C.
#[cfg(not(unix))]
fn interruption() -> io::Result<impl Future<Output = ()>> {
    Ok(async {
        let _ = tokio::signal::ctrl_c().await;
    })
}

/// 16 random bytes in hexadecimal digits.
fn token() -> Result<String, Error> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|error| Error::Option {
        option: "host-sim serve".into(),
        problem: format!("the system gives no random numbers ({error})"),
        remedy: "run it on another computer".into(),
    })?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
