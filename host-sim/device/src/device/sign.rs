//! Signs updates of the firmware.

use firmware::update::header::{HEADER_LEN, Header, SIGNED_LEN, board, digest};
use firmware::wire::command::key::Secret;
use salty::Keypair;

/// An image and the address of the slot that it is linked for.
pub type Linked = (u32, Vec<u8>);

/// The public key of a key that signs.
#[must_use]
pub fn public_key(key: &Secret) -> [u8; 32] {
    Keypair::from(&key.0).public.to_bytes()
}

/// The file of an update: each image behind its signed header. `None`: the board's name is longer
/// than 12 bytes.
#[must_use]
pub fn signed(name: &str, version: [u16; 3], images: &[Linked], key: &Secret) -> Option<Vec<u8>> {
    let (board, key) = (board(name)?, Keypair::from(&key.0));
    let mut file = Vec::new();
    for (address, image) in images {
        let header = Header {
            version,
            address: *address,
            length: image.len() as u32,
            board,
            digest: digest([&image[..]]),
        };
        let mut bytes = [0; HEADER_LEN];
        let (stated, signature) = bytes.split_at_mut(SIGNED_LEN);
        stated.copy_from_slice(&header.signed());
        signature.copy_from_slice(&key.sign(stated).to_bytes());
        file.extend(bytes);
        file.extend(image);
    }
    Some(file)
}
