// A controller of ros2_control around libclutch.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "clutch.h"
#include "controller_interface/controller_interface.hpp"

namespace clutch_controller
{

/// An axis of libclutch: the position of a joint (rad) in, the voltage of its actuator (V) out.
///
/// Parameters: `joint`, its name; `command_interface`, the name of the actuator's voltage (`effort` unless given). The settings are those
/// with which it was compiled; their safe state has to be `hold` or `release`. To activate it is the consent, to deactivate it an operator's stop.
class ClutchController : public controller_interface::ControllerInterface
{
public:
  controller_interface::CallbackReturn on_init() override;
  controller_interface::InterfaceConfiguration command_interface_configuration() const override;
  controller_interface::InterfaceConfiguration state_interface_configuration() const override;
  controller_interface::CallbackReturn on_configure(const rclcpp_lifecycle::State & previous) override;
  controller_interface::CallbackReturn on_activate(const rclcpp_lifecycle::State & previous) override;
  controller_interface::CallbackReturn on_deactivate(const rclcpp_lifecycle::State & previous) override;
  controller_interface::return_type update(const rclcpp::Time & time, const rclcpp::Duration & period) override;

private:
  /// Writes a code as a voltage; false if the code has none.
  bool write(std::uint16_t code);

  std::string joint_;
  std::string command_;
  clutch_axis axis_;
  std::uint64_t last_us_ = 0;
  std::uint16_t sequence_ = 0;
  bool started_ = false;
  std::uint16_t code_ = 0;
};

}  // namespace clutch_controller
