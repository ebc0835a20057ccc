//! Special registers.

/// Special registers for MRS and MSR (B5.2.2).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Special {
    /// APSR, IPSR, EPSR and combinations; the number's lower bits say which.
    Psr(u8),
    Msp,
    Psp,
    Primask,
    Basepri,
    BasepriMax,
    Faultmask,
    Control,
}
