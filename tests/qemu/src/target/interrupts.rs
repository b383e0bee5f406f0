//! The interrupt table of programs without interrupts: one entry, as `cortex-m-rt` wants a table with its feature `device`.

unsafe extern "C" {
    /// Of `cortex-m-rt`: stays in a loop.
    fn DefaultHandler();
}

// SAFETY: `cortex-m-rt` puts this section behind the exceptions and expects this name; the entry is the address of a function
// of the C calling convention.
#[unsafe(link_section = ".vector_table.interrupts")]
#[unsafe(no_mangle)]
static __INTERRUPTS: [unsafe extern "C" fn(); 1] = [DefaultHandler];
