// SPDX-License-Identifier: MIT OR Apache-2.0
#include "clutch_controller/clutch_controller.hpp"

#include <cmath>

#include "pluginlib/class_list_macros.hpp"
#include "run.h"

namespace clutch_controller
{

using controller_interface::CallbackReturn;
using controller_interface::interface_configuration_type;
using controller_interface::return_type;

CallbackReturn ClutchController::on_init()
{
  joint_ = auto_declare<std::string>("joint", "");
  command_ = auto_declare<std::string>("command_interface", "effort");
  return CallbackReturn::SUCCESS;
}

controller_interface::InterfaceConfiguration ClutchController::command_interface_configuration() const
{
  return {interface_configuration_type::INDIVIDUAL, {joint_ + "/" + command_}};
}

controller_interface::InterfaceConfiguration ClutchController::state_interface_configuration() const
{
  return {interface_configuration_type::INDIVIDUAL, {joint_ + "/position"}};
}

CallbackReturn ClutchController::on_configure(const rclcpp_lifecycle::State &)
{
  joint_ = get_node()->get_parameter("joint").as_string();
  command_ = get_node()->get_parameter("command_interface").as_string();
  clutch_misfit misfit;
  const bool built = clutch_axis_build(
    &axis_, run_settings, run_settings_count, run_knots, run_knots_count, &misfit) == CLUTCH_OK;
  clutch_safe_codes safe;
  if (joint_.empty() || !built || clutch_axis_safe(&axis_, &safe) != CLUTCH_OK) {
    return CallbackReturn::ERROR;
  }
  code_ = safe.hold;
  return CallbackReturn::SUCCESS;
}

CallbackReturn ClutchController::on_activate(const rclcpp_lifecycle::State &)
{
  // After an end that was wanted, or a fault that somebody has seen.
  clutch_axis_acknowledge(&axis_);
  const bool driving = clutch_axis_consent(&axis_, code_) == CLUTCH_OK;
  return driving ? CallbackReturn::SUCCESS : CallbackReturn::ERROR;
}

CallbackReturn ClutchController::on_deactivate(const rclcpp_lifecycle::State &)
{
  clutch_axis_stop(&axis_);
  const bool told = clutch_axis_state(&axis_, nullptr, nullptr, &code_) == CLUTCH_OK;
  return told && write(code_) ? CallbackReturn::SUCCESS : CallbackReturn::ERROR;
}

return_type ClutchController::update(const rclcpp::Time & time, const rclcpp::Duration &)
{
  const double position = state_interfaces_[0].get_value();
  clutch_sample sample = {};
  // The manager calls once a period; what it leaves out shows in the time.
  sample.sequence = sequence_++;
  sample.time_us = static_cast<std::uint32_t>(time.nanoseconds() / 1000);
  sample.encoder_fault = !std::isfinite(position);
  if (std::isfinite(position)) {
    constexpr double turn = 6.283185307179586;
    const double counts = std::floor(position * run_counts_per_rev / turn);
    sample.counts = static_cast<std::int32_t>(static_cast<std::int64_t>(counts));
  }
  sample.board = CLUTCH_BOARD_DRIVING;
  clutch_cycle cycle;
  if (clutch_axis_sample(&axis_, &sample, &cycle) != CLUTCH_OK) {
    return return_type::ERROR;
  }
  std::uint8_t state = 0;
  std::uint16_t code = code_;
  clutch_axis_state(&axis_, &state, nullptr, &code);
  if (cycle.answered || state >= CLUTCH_STATE_HOLDING) {
    code_ = code;
  }
  return write(code_) ? return_type::OK : return_type::ERROR;
}

bool ClutchController::write(std::uint16_t code)
{
  float volts = 0.0f;
  if (clutch_axis_volts(&axis_, code, &volts) != CLUTCH_OK) {
    return false;
  }
  command_interfaces_[0].set_value(static_cast<double>(volts));
  return true;
}

}  // namespace clutch_controller

PLUGINLIB_EXPORT_CLASS(clutch_controller::ClutchController, controller_interface::ControllerInterface)
