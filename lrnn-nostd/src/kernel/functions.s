@ The functions of one form: `forward`, `advance` and `descend` with the macros mla3, mla, mls,
@ product and less as they are currently defined.
.macro function name, what, form
    .section .text.\name\()_\form,"ax",%progbits
    .globl \name\()_\form
    .type \name\()_\form, %function
    .thumb_func
\name\()_\form:
    \what
    .size \name\()_\form, . - \name\()_\form
.endm
.macro functions form
    function lrnn_nostd_forward, forward, \form
    function lrnn_nostd_advance, advance, \form
    function lrnn_nostd_descend, descend, \form
    .purgem mla3
    .purgem mla
    .purgem mls
    .purgem product
    .purgem less
    .text
.endm
