// SPDX-License-Identifier: MIT OR Apache-2.0
#include "clutch_controller/clutch_controller.hpp"

#include <algorithm>
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
  const bool built = clutch_axis_build(&axis_, &run, &misfit) == CLUTCH_OK;
  clutch_safe_codes safe;
  if (joint_.empty() || !built || clutch_axis_safe(&axis_, &safe) != CLUTCH_OK) {
    return CallbackReturn::ERROR;
  }
  // After a deactivation nobody calls update(): a safe state that goes on step by step would stop after its first.
  if (safe.kind != CLUTCH_SAFE_HOLD && safe.kind != CLUTCH_SAFE_RELEASE) {
    return CallbackReturn::ERROR;
  }
  code_ = safe.hold;
  return CallbackReturn::SUCCESS;
}

CallbackReturn ClutchController::on_activate(const rclcpp_lifecycle::State &)
{
  // After an end that was wanted, or a fault that somebody has seen.
  clutch_axis_acknowledge(&axis_);
  started_ = false;
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
  constexpr double turn = 6.283185307179586;
  const double counts = std::floor(state_interfaces_[0].get_value() * run_counts_per_rev / turn);
  const std::uint64_t now_us = static_cast<std::uint64_t>(time.nanoseconds() / 1000);
  // A period that the manager left out is a sample that was lost.
  const std::uint64_t passed = started_ ? (now_us - last_us_ + run_period_us / 2) / run_period_us : 1;
  sequence_ = static_cast<std::uint16_t>(sequence_ + std::min<std::uint64_t>(passed, 0x7fff));
  last_us_ = now_us;
  started_ = true;
  clutch_sample sample = {};
  sample.sequence = sequence_;
  sample.time_us = static_cast<std::uint32_t>(now_us);
  // Counts wrap; a position that is none, or that no shaft has, is a fault of the encoder.
  if (std::isfinite(counts) && std::abs(counts) < 1e15) {
    sample.counts = static_cast<std::int32_t>(static_cast<std::uint32_t>(static_cast<std::int64_t>(counts)));
  } else {
    sample.encoder_fault = 1;
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
  // The manager deactivates a controller that reports an error: after a fault the output stays in the safe state.
  return write(code_) && state != CLUTCH_STATE_FAULTED ? return_type::OK : return_type::ERROR;
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
