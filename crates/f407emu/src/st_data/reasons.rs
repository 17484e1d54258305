//! The reasons why the emulator's registers differ from ST's data, by the registers' names. `*`
//! stands for any text.

/// Differences of address, access or reserved bits.
pub(super) const ROWS: &[(&str, &str)] = &[
    ("RCC.CFGR", "SWS can only be read (RM0090 section 7.3.3)"),
    (
        "RCC.CSR",
        "of the reset flags only RMVF can be written (RM0090 section 7.3.21)",
    ),
    (
        "SYSCFG.CMPCR",
        "CMP_PD can be written (RM0090 section 9.2.7)",
    ),
    (
        "PWR.CR",
        "CSBF and CWUF always read as 0 (RM0090 section 5.4.1)",
    ),
    ("OTG_FS_GLOBAL.DIEPTXF[3]", FOUR),
    ("OTG_FS_GLOBAL.DIEPTXF[4]", FOUR),
    ("OTG_FS_DEVICE.DIEP[3]*", FOUR),
    ("OTG_FS_DEVICE.DIEP[4]*", FOUR),
    ("OTG_FS_DEVICE.DOEP[3]*", FOUR),
    ("OTG_FS_DEVICE.DOEP[4]*", FOUR),
    ("ADC2.*", ONE),
    ("ADC3.*", ONE),
];

const ONE: &str = "of the three converters the firmware uses ADC1: the others are not there";

const FOUR: &str = "endpoint 0 and three more in each direction (RM0090 section 34.2.3)";

/// Differences of the value after a reset.
pub(super) const RESETS: &[(&str, &str)] = &[
    (
        "TIM*.ARR",
        "all ones, as the chip is known to have it; the firmware writes it before it counts",
    ),
    ("PWR.CR", "VOS is 1 (RM0090 section 5.4.1)"),
    ("PWR.CSR", "the regulator is always ready"),
    (
        "FLASH.OPTCR",
        "the option bytes as delivered (RM0090 section 3.9.9)",
    ),
    ("OTG_FS_GLOBAL.GRSTCTL", "nothing is ever under way: AHBIDL"),
    (
        "OTG_FS_DEVICE.DIEP[*].TXFSTS",
        "room for as much as DIEPTXFx says after a reset",
    ),
    (
        "OTG_FS_GLOBAL.CID",
        "the F405 and F407 say 0x1100, by which the driver knows them",
    ),
];

/// Bits that can be read and written, but do not read back the written value.
pub(super) const PLAIN: &[(&str, &str)] = &[
    ("RCC.CSR", "RMVF acts, and reads as 0"),
    ("CRC.DR", "a word goes into the sum, which is read"),
    (
        "ADC1.CR2",
        "JSWSTART acts, and reads as 0 (RM0090 section 13.13.3)",
    ),
    ("TIM*.DMAR", "bursts of DMA are not modelled"),
    ("IWDG.PR", "locked until its key (RM0090 section 21.3.2)"),
    (
        "USART*.DR",
        "what is written is sent, what is read was received",
    ),
    (
        "PWR.CSR",
        "the backup regulator and the wake-up pin are not modelled",
    ),
    ("FLASH.CR", "locked until its keys (RM0090 section 3.6.1)"),
    ("FLASH.OPTCR", "option bytes cannot be written here"),
    ("OTG_FS_GLOBAL.GRSTCTL", "resets are over at once"),
    ("OTG_FS_GLOBAL.GINTSTS", "ones clear its flags"),
    ("OTG_FS_GLOBAL.CID", "nothing can be noted there"),
    ("OTG_FS_DEVICE.DIEP*.INT", "ones clear its flags"),
    ("OTG_FS_DEVICE.DOEP*.INT", "ones clear its flags"),
    (
        "OTG_FS_DEVICE.DIEP*.CTL",
        "enabled and disabled at once: disabled",
    ),
    (
        "OTG_FS_DEVICE.DOEP*.CTL",
        "enabled and disabled at once: disabled",
    ),
];
