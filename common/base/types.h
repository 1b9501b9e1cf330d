#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace archetide {

using Vec3 = Eigen::Vector3d;
using Vec3i = Eigen::Vector3i;
using Mat3 = Eigen::Matrix3d;
using VecX = Eigen::VectorXd;
using MatX = Eigen::MatrixXd;
using Quat = Eigen::Quaterniond;

}  // namespace archetide
