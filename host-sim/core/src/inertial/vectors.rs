//! Code for the widest vectors of the processor.

/// Compiles an expression for three kinds of vectors and runs it with the widest that the processor
/// has; nothing but the speed depends on it. `simd` is the kind. What the expression calls gets
/// these vectors if it is inlined.
#[cfg(target_arch = "x86_64")]
macro_rules! widest {
    ($simd:pat => $code:expr) => {{
        use fearless_simd::Simd as _;
        let level = fearless_simd::Level::new();
        if let Some(simd) = level.as_avx512() {
            simd.vectorize(
                #[inline(always)]
                || {
                    let $simd = simd;
                    $code
                },
            )
        } else if let Some(simd) = level.as_avx2() {
            simd.vectorize(
                #[inline(always)]
                || {
                    let $simd = simd;
                    $code
                },
            )
        } else if let Some(simd) = level.as_sse2() {
            simd.vectorize(
                #[inline(always)]
                || {
                    let $simd = simd;
                    $code
                },
            )
        } else {
            unreachable!("every x86-64 has the last ones")
        }
    }};
}

#[cfg(not(target_arch = "x86_64"))]
macro_rules! widest {
    ($simd:pat => $code:expr) => {
        fearless_simd::dispatch!(fearless_simd::Level::new(), $simd => $code)
    };
}

pub(crate) use widest;
