//! Tests of the command line and of the modules behind it. One program, so that linking happens once.

mod bench_drive;
mod board_layer;
mod campaign;
mod command;
mod command_line;
mod commission;
mod commission_port;
mod commission_study;
mod compare_command;
mod compare_sweep;
mod cycles;
mod documented_tables;
mod documents;
mod first_power_up;
mod identify_command;
mod image;
mod lossy_line;
mod monitor;
mod observer_design;
mod paper;
#[path = "../../../design/tests/suite/published/mod.rs"]
mod published;
mod report_browser;
mod report_command;
mod report_devtools;
mod report_figures;
mod report_page;
mod report_rigs;
mod reproduce_numbers;
mod robust_command;
mod shaken;
mod split_command;
mod twin_door;
mod twin_page;
mod verify_command;
mod virtual_board;
