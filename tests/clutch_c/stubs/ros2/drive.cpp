// Drives the controller of ros2_control as its manager would, on the shaft of the examples.
#include <cstdio>

#include "clutch_controller/clutch_controller.hpp"
#include "run.h"
extern "C" {
#include "shaft.h"
}

int main()
{
  using controller_interface::CallbackReturn;
  using controller_interface::return_type;
  clutch_controller::ClutchController controller;
  const rclcpp_lifecycle::State before;
  if (controller.on_init() != CallbackReturn::SUCCESS || controller.on_configure(before) != CallbackReturn::ERROR) {
    return 2;  // without a joint it must not come up
  }
  controller.get_node()->parameters["joint"] = "brake";
  if (controller.on_configure(before) != CallbackReturn::SUCCESS ||
    controller.command_interface_configuration().names != std::vector<std::string>{"brake/effort"} ||
    controller.on_activate(before) != CallbackReturn::SUCCESS)
  {
    return 3;
  }
  shaft_t shaft = SHAFT_AT_REST;
  for (std::int64_t tick = 0; tick < 5000; tick++) {
    controller.state_interfaces_[0].value = shaft.angle;
    const rclcpp::Time now(tick * 1000000);
    if (controller.update(now, rclcpp::Duration()) != return_type::OK) {
      return 4;
    }
    shaft.volts = controller.command_interfaces_[0].value;
    for (int i = 0; i < run_period_us; i++) {
      shaft_move(&shaft);
    }
  }
  std::printf("%.4f deg, %.4f V\n", shaft.angle * 57.29578, shaft.volts);
  if (controller.on_deactivate(before) != CallbackReturn::SUCCESS) {
    return 5;
  }
  std::printf("%.4f V\n", controller.command_interfaces_[0].value);
  return 0;
}
