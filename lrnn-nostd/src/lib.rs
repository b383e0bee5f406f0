//! placeholder, written by the network author
#![no_std]
