//! The application as a black box between four lines: bytes in, bytes out, time.

mod activation;
mod adis;
mod aside;
mod bypass;
mod channels;
mod command;
mod configuration;
mod damage;
mod device;
mod epson;
mod fixes;
mod frames;
mod gaps;
mod identity;
mod learn;
mod next_power_on;
mod receivers;
mod record;
mod reverse;
mod status;
mod stored;
mod sums;
mod taught;
mod text;
mod told;
mod turn_on;
