//! The serial line: a serial port on the USB bus (CDC).

use hal::clocks::UsbClock;
use hal::pac::RESETS;
use hal::usb::UsbBus;
use upright::heapless::Deque;
use upright::protocol::serial_link::MAX_MESSAGE;
use usb_device::bus::UsbBusAllocator;
use usb_device::device::{StringDescriptors, UsbDevice, UsbDeviceBuilder, UsbVidPid};
use usbd_serial::{SerialPort, USB_CLASS_CDC};

use super::chip;

/// Vendor and product for serial ports of free software (pid.codes, V-USB).
const IDENTITY: UsbVidPid = UsbVidPid(0x16c0, 0x27dd);

/// The bus, which device and port refer to.
pub(crate) struct UsbMemory(Option<UsbBusAllocator<UsbBus>>);

impl UsbMemory {
    /// Empty.
    pub(crate) const fn new() -> Self {
        Self(None)
    }
}

/// The bus of this chip.
pub(super) fn bus(clock: UsbClock, resets: &mut RESETS) -> UsbBusAllocator<UsbBus> {
    // SAFETY: nothing else uses them.
    let (registers, memory) = unsafe { (chip::UsbRegisters::steal(), chip::UsbMemory::steal()) };
    // The Pico does not connect the bus's supply to the chip.
    UsbBusAllocator::new(UsbBus::new(registers, memory, clock, true, resets))
}

/// The port, with what has been received and what is being sent.
pub(crate) struct UsbLine {
    device: UsbDevice<'static, UsbBus>,
    port: SerialPort<'static, UsbBus>,
    received: Deque<u8, 128>,
    sent: Deque<u8, MAX_MESSAGE>,
}

impl UsbLine {
    /// Shows the device to the host. `None` if its descriptors do not fit, which they do.
    pub(super) fn set_up(bus: UsbBusAllocator<UsbBus>, memory: &'static mut UsbMemory) -> Option<Self> {
        let bus = memory.0.insert(bus);
        let port = SerialPort::new(bus);
        let strings = StringDescriptors::default().manufacturer("Upright").product(chip::PRODUCT);
        let device = UsbDeviceBuilder::new(bus, IDENTITY)
            .strings(&[strings])
            .ok()?
            .max_packet_size_0(64)
            .ok()?
            .device_class(USB_CLASS_CDC)
            .build();
        Some(Self { device, port, received: Deque::new(), sent: Deque::new() })
    }

    /// Moves bytes in both directions.
    pub(crate) fn serve(&mut self) {
        self.device.poll(&mut [&mut self.port]);
        let mut bytes = [0; 64];
        // What does not fit stays with the host.
        if self.received.capacity() - self.received.len() >= bytes.len()
            && let Ok(length) = self.port.read(&mut bytes)
        {
            for &byte in bytes.iter().take(length) {
                let _ = self.received.push_back(byte);
            }
        }
        self.send();
    }

    fn send(&mut self) {
        while let Ok(length) = self.port.write(self.sent.as_slices().0)
            && length > 0
        {
            for _ in 0..length {
                self.sent.pop_front();
            }
        }
        let _ = self.port.flush();
    }

    /// The next byte from the host, if any.
    pub(crate) fn read(&mut self) -> Option<u8> {
        self.received.pop_front()
    }

    /// Whether the last frame has been sent, so that there is room for another one.
    pub(crate) fn is_free(&self) -> bool {
        self.sent.is_empty()
    }

    /// Sends a frame to the host; the line has to be free.
    pub(crate) fn write(&mut self, frame: &[u8]) {
        for &byte in frame {
            let _ = self.sent.push_back(byte);
        }
        self.send();
    }
}
