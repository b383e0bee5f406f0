//! Every registered format has a table, and its values reach the device's settings.

use super::*;
use firmware::sample::{Quantity, Units};
use firmware::wire::adis::{Form, Model};
use firmware::wire::stim300::Extra;
use firmware::wire::stim300::config::Range;

fn read(text: &str) -> Sensor {
    toml::from_str(text).unwrap()
}

fn stream(text: &str) -> Settings {
    let Some(configuration::Sensor::Stream(format)) = read(text).settings().unwrap() else {
        panic!("{text}: no stream");
    };
    let mut settings = Settings::DEFAULT;
    format.apply(&mut settings);
    settings
}

fn key_of_mistake(text: &str) -> String {
    read(text).settings().unwrap_err().key
}

#[test]
fn every_registered_format_has_a_name_in_the_unit_file() {
    for format in ImuFormat::ALL {
        let named = FormatName::ALL.iter().find(|n| n.name() == format.name());
        let named = named.unwrap_or_else(|| panic!("no row of `sensor!`: {}", format.name()));
        let sensor = Sensor::of(*named);
        assert_eq!(sensor.imu_format(), Some(format));
        assert_eq!(read(&format!("format = '{}'", format.name())), sensor);
        let Some(configuration::Sensor::Stream(settings)) = sensor.settings().unwrap() else {
            panic!("{}: no stream", format.name());
        };
        assert_eq!(settings.format(), format);
        assert!(sensor.rate() >= 1.0, "{}", format.name());
        assert!(
            sensor.bits_per_second().unwrap() > 100.0,
            "{}",
            format.name()
        );
    }
    for name in FormatName::ALL {
        let special = matches!(name, FormatName::Detect | FormatName::AdisSpi);
        assert_eq!(
            ImuFormat::from_name(name.name()).is_none(),
            special,
            "{name:?}"
        );
    }
}

/// Values by the datasheet TS1524, equations 1 to 4 and table 5-21.
#[test]
fn the_table_of_a_stim300_becomes_its_configuration_datagram() {
    let text = "format = 'stim300'\nrate_hz = 2000\nbaud = 1843200\n[stim300]\n\
                datagram = '0xA7'\ngyro_output = 'average'\naccel_output = 'rate'\n\
                accel_range_g = 30\nline_end = 'crlf'\nask = false\nanswer_ms = 0\nfamily = 'pps'";
    let stim300 = stream(text).stim300;
    let config = stim300.config;
    assert_eq!(config.sample_rate(), Ok(Some(2000)));
    assert_eq!(config.bit_rate(), Ok(Some(1_843_200)));
    assert_eq!(config.contents().id(), 0xA7);
    assert_eq!(config.ranges(), Ok([Range::G30; 3]));
    assert!(config.crlf());
    let units = config.units().unwrap();
    assert_eq!(units.gyro.quantity, Quantity::Average);
    assert_eq!(units.accel.lsb, 9.806_65 / 262_144.0); // 2^18 counts a g
    assert_eq!(
        (stim300.ask, stim300.answer_us, stim300.family),
        (false, None, Some(Extra::Pps))
    );
    // three clusters of 10 bytes, three of 7 for temperatures, 8 around them, CR LF: 61 bytes
    assert_eq!(read(text).bits_per_second(), Some(61.0 * 10.0 * 2000.0));
    let default = stream("format = 'stim300'").stim300;
    assert_eq!(default, Settings::DEFAULT.stim300);
}

#[test]
fn tables_of_other_formats_reach_the_device() {
    let kvh = stream("format = 'kvh'\n[kvh]\nrotation = 'rate'\nangle = 'deg'").kvh;
    assert_eq!((kvh.delta, kvh.degrees), (false, true));
    let novatel = "format = 'novatel'\n[novatel]\nimu_type = 12";
    assert_eq!(stream(novatel).novatel.imu_type.0, 12);
    assert_eq!(read(novatel).rate(), 100.0);
    let adis = read("format = 'adis-spi'\n[adis]\nmodel = 'ADIS16495-2'");
    let Some(configuration::Sensor::Spi(settings)) = adis.settings().unwrap() else {
        panic!("no SPI sensor");
    };
    // Linux adis16480: ADIS16495-2 has 40 LSB per deg/s in the upper word, 4000 per g
    let Units { gyro, accel } = settings.units;
    assert_eq!(settings.form, Form::Adis1649x);
    assert!((gyro.lsb - (0.025_f64 / 65_536.0).to_radians()).abs() < 1e-18);
    assert!((accel.lsb - 0.25e-3 * 9.806_65 / 65_536.0).abs() < 1e-18);
    assert!(!settings.framed);
    let framed = read("format = 'adis-spi'\n[adis]\nmodel = 'ADIS16470'\nframed = true");
    let Some(configuration::Sensor::Spi(settings)) = framed.settings().unwrap() else {
        panic!("no SPI sensor");
    };
    assert!(settings.framed);
    let uart = "format = 'adis-uart'\n[adis_uart]\nmodel = 'ADIS16507-3'";
    assert_eq!(stream(uart).adis_uart.model, Model::Adis16507(3));
    let epson = "format = 'epson'\n[epson]\nmodel = 'G370PDF1'\nburst_ctrl1 = 0xCC03\n\
                 burst_ctrl2 = 0x4C00\nangle_range = 3\nvelocity_range = 4\ncount_step = 1";
    let epson = stream(epson).epson;
    assert_eq!(epson.layout.registers(), [0xCC03, 0x4C00]);
    assert_eq!((epson.angle_range, epson.velocity_range), (3, 4));
    assert_eq!((epson.model.name(), epson.count_step), ("G370PDF1", 1));
    assert_eq!(stream("format = 'epson'").epson, Settings::DEFAULT.epson);
    assert_eq!(read("format = 'detect'").settings().unwrap(), None);
}

#[test]
fn values_that_no_such_sensor_has_are_named() {
    let stim300 = |line: &str| key_of_mistake(&format!("format = 'stim300'\n[stim300]\n{line}"));
    assert_eq!(stim300("datagram = '0x77'"), "sensor.stim300.datagram");
    assert_eq!(
        stim300("accel_range_g = 20"),
        "sensor.stim300.accel_range_g"
    );
    assert_eq!(
        key_of_mistake("format = 'stim300'\nrate_hz = 300"),
        "sensor.rate_hz"
    );
    let novatel = "format = 'novatel'\n[novatel]\nimu_type = 200";
    assert_eq!(key_of_mistake(novatel), "sensor.novatel.imu_type");
    let epson = |line: &str| key_of_mistake(&format!("format = 'epson'\n[epson]\n{line}"));
    assert_eq!(epson("burst_ctrl1 = 0xF002"), "sensor.epson.burst_ctrl1");
    assert_eq!(epson("burst_ctrl1 = 0xC003"), "sensor.epson.burst_ctrl1");
    assert_eq!(epson("model = 'G362PDC1'"), "sensor.epson.model");
    let old = "model = 'G320PDG0'\nburst_ctrl1 = 0xCC03";
    assert_eq!(epson(old), "sensor.epson.model", "no increments");
    assert_eq!(
        epson("model = 'G320PDG0'\nhigh_range = true"),
        "sensor.epson.model"
    );
    let uart = "format = 'adis-uart'\n[adis_uart]\nmodel = 'ADIS16495'";
    assert_eq!(key_of_mistake(uart), "sensor.adis_uart.model");
    for model in [
        "ADIS16495",
        "ADIS16495-4",
        "ADIS16470-1",
        "ADIS16400-1",
        "16495-1",
        "ADIS16495-1-1",
    ] {
        let text = format!("format = 'adis-spi'\n[adis]\nmodel = '{model}'");
        assert_eq!(key_of_mistake(&text), "sensor.adis.model", "{model}");
    }
}
