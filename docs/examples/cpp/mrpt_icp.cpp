// MRPT's ICP-SLAM (mrpt::slam::CMetricMapBuilderICP, 2.x): each scan is matched with a map of points.
#include <mrpt/maps/CSimplePointsMap.h>
#include <mrpt/obs/CObservation2DRangeScan.h>
#include <mrpt/obs/CObservationOdometry.h>
#include <mrpt/poses/CPose3DPDF.h>
#include <mrpt/slam/CMetricMapBuilderICP.h>

#include "driver.h"

using mrpt::maps::CSimplePointsMap;
using mrpt::obs::CObservation2DRangeScan;
using mrpt::obs::CObservationOdometry;

class MrptIcp {
   public:
    explicit MrptIcp(const driver::Laser& laser) : laser_(laser) {
        builder_.setMinLoggingLevel(mrpt::system::LVL_ERROR);
        CSimplePointsMap::TMapDefinition points;
        points.insertionOpts.minDistBetweenLaserPoints = 0.05;  // m
        points.insertionOpts.isPlanarMap = true;
        builder_.ICP_options.mapInitializers.push_back(points);
        // As the adapter mrpt-icp-slam, whose values were chosen on development drives.
        builder_.ICP_options.localizationLinDistance = 0.1;
        builder_.ICP_options.localizationAngDistance = mrpt::DEG2RAD(2.0);
        builder_.ICP_options.insertionLinDistance = 0.5;
        builder_.ICP_options.insertionAngDistance = mrpt::DEG2RAD(15.0);
        builder_.ICP_options.minICPgoodnessToAccept = 0.4;
        builder_.ICP_params.ICP_algorithm = mrpt::slam::icpLevenbergMarquardt;
        builder_.ICP_params.maxIterations = 80;
        builder_.ICP_params.thresholdDist = 0.3;
        builder_.ICP_params.thresholdAng = mrpt::DEG2RAD(5.0);
        builder_.ICP_params.ALFA = 0.8;
        builder_.ICP_params.smallestThresholdDist = 0.05;
        builder_.ICP_params.corresponding_points_decimation = 1;
        builder_.initialize();
    }

    driver::Pose update(const driver::Reading& reading) {
        const auto stamp = mrpt::Clock::fromDouble(1e9 + reading.time);  // 0 s is no time in MRPT
        const auto& [x, y, theta] = reading.odometry;
        auto odometry = CObservationOdometry::Create();
        odometry->timestamp = stamp;
        odometry->odometry = mrpt::poses::CPose2D(x, y, theta);
        builder_.processObservation(odometry);
        builder_.processObservation(scan(reading, stamp));
        const auto mean = builder_.getCurrentPoseEstimation()->getMeanVal();
        return {mean.x(), mean.y(), mean.yaw()};
    }

   private:
    CObservation2DRangeScan::Ptr scan(
        const driver::Reading& reading, mrpt::Clock::time_point stamp) const {
        auto made = CObservation2DRangeScan::Create();
        const size_t beams = reading.ranges.size();
        const double field = laser_.angle_increment * (static_cast<double>(beams) - 1);
        made->timestamp = stamp;
        made->sensorLabel = "LASER";
        made->aperture = static_cast<float>(std::abs(field));
        made->rightToLeft = field > 0;
        made->maxRange = static_cast<float>(laser_.range_max);
        // MRPT's beams lie evenly about the direction in which the sensor looks.
        const double middle = laser_.mount.theta + laser_.angle_min + field / 2;
        made->sensorPose = mrpt::poses::CPose3D(laser_.mount.x, laser_.mount.y, 0, middle, 0, 0);
        made->resizeScan(beams);
        for (size_t k = 0; k < beams; ++k) {
            const double range = reading.ranges[k];
            const bool echo = range > laser_.range_min && range < laser_.range_max;
            made->setScanRange(k, static_cast<float>(echo ? range : laser_.range_max));
            made->setScanRangeValidity(k, echo);
        }
        return made;
    }

    driver::Laser laser_;
    mrpt::slam::CMetricMapBuilderICP builder_;
};

int main(int count, char** words) { return driver::run<MrptIcp>(count, words); }
