// The part of ros2_control (Humble to Jazzy) that the controller takes, as little as it needs: to compile and drive it where no ROS is.
#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace rclcpp
{
class Time
{
public:
  explicit Time(std::int64_t nanoseconds) : nanoseconds_(nanoseconds) {}
  std::int64_t nanoseconds() const {return nanoseconds_;}

private:
  std::int64_t nanoseconds_;
};
class Duration {};
class Parameter
{
public:
  std::string text;
  const std::string & as_string() const {return text;}
};
}  // namespace rclcpp

namespace rclcpp_lifecycle
{
class State {};
class LifecycleNode
{
public:
  std::map<std::string, std::string> parameters;
  rclcpp::Parameter get_parameter(const std::string & name) const {return {parameters.at(name)};}
};
}  // namespace rclcpp_lifecycle

namespace hardware_interface
{
class LoanedInterface
{
public:
  double value = 0.0;
  double get_value() const {return value;}
  void set_value(double to) {value = to;}
};
}  // namespace hardware_interface

namespace controller_interface
{
enum class CallbackReturn { SUCCESS, FAILURE, ERROR };
enum class return_type { OK, ERROR };
enum class interface_configuration_type { ALL, INDIVIDUAL, NONE };
struct InterfaceConfiguration
{
  interface_configuration_type type;
  std::vector<std::string> names;
};
class ControllerInterface
{
public:
  virtual ~ControllerInterface() = default;
  virtual CallbackReturn on_init() = 0;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_deactivate(const rclcpp_lifecycle::State &) = 0;
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const {return node_;}
  template<typename T>
  T auto_declare(const std::string & name, const T & value)
  {
    return node_->parameters.emplace(name, value).first->second;
  }
  std::vector<hardware_interface::LoanedInterface> command_interfaces_{1};
  std::vector<hardware_interface::LoanedInterface> state_interfaces_{1};

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ = std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};
}  // namespace controller_interface
