// Runs a SLAM in C++ on the table of scans that dynslam writes: `program LOG.csv TRAJECTORY.tum`.
//
//     struct MySlam {
//         explicit MySlam(const driver::Laser& laser);
//         driver::Pose update(const driver::Reading& reading);  // the pose at this scan
//     };
//     int main(int n, char** words) { return driver::run<MySlam>(n, words); }
//
// C++17 and its standard library alone; metres, radians, seconds.
#pragma once

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <limits>
#include <map>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace driver {

struct Pose {
    double x = 0.0, y = 0.0, theta = 0.0;
};

// A laser with evenly spread beams; the first of them at angle_min, counter-clockwise if
// angle_increment is positive. `mount` is its pose on the robot.
struct Laser {
    double angle_min = 0.0, angle_increment = 0.0;
    double range_min = 0.0, range_max = 0.0;
    Pose mount;
};

// A scan, and the odometry's pose at its time. In `ranges`, infinite or range_max and more is no
// echo, NaN or less than range_min is no reading.
struct Reading {
    double time = 0.0;
    Pose odometry;
    std::vector<double> ranges;
};

struct Recording {
    Laser laser;
    std::vector<Reading> readings;
};

inline double number(const std::string& text) {
    if (text.empty()) return std::numeric_limits<double>::quiet_NaN();
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (*end && *end != '\r') throw std::runtime_error("no number: " + text);
    return value;
}

inline std::vector<double> numbers(const std::string& line, char separator) {
    std::vector<double> found;
    std::istringstream words(line);
    for (std::string word; std::getline(words, word, separator);)
        if (separator != ' ' || !word.empty()) found.push_back(number(word));
    return found;
}

inline Laser laser_of(std::map<std::string, std::vector<double>> head) {
    for (const char* name : {"angle_min", "angle_increment", "range_max"})
        if (head[name].size() != 1) throw std::runtime_error(std::string("no ") + name);
    Laser laser{head["angle_min"][0], head["angle_increment"][0], 0.0, head["range_max"][0], {}};
    if (head["range_min"].size() == 1) laser.range_min = head["range_min"][0];
    const auto& mount = head["mount"];
    if (mount.size() == 3) laser.mount = {mount[0], mount[1], mount[2]};
    return laser;
}

// The rows with a scan; those with an odometry pose alone are left out.
inline Recording read(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error(path + ": cannot be read");
    Recording recording;
    std::map<std::string, std::vector<double>> head;
    for (std::string line; std::getline(file, line);) {
        if (line.empty() || line.rfind("time", 0) == 0) continue;
        if (line[0] == '#') {  // `# name: value`
            const auto colon = line.find(':');
            if (colon == std::string::npos) continue;
            const auto first = line.find_first_not_of("# ");
            head[line.substr(first, colon - first)] = numbers(line.substr(colon + 1), ' ');
            continue;
        }
        const auto row = numbers(line, ',');
        if (row.size() < 5) throw std::runtime_error(path + ": a row without a scan");
        Reading reading{row[0], {row[1], row[2], row[3]}, {row.begin() + 4, row.end()}};
        bool any = false;
        for (double range : reading.ranges) any |= !std::isnan(range);
        if (any) recording.readings.push_back(std::move(reading));
    }
    recording.laser = laser_of(head);
    return recording;
}

template <class Slam>
int run(int count, char** words) {
    if (count != 3) {
        std::cerr << "usage: " << words[0] << " LOG.csv TRAJECTORY.tum\n";
        return 2;
    }
    try {
        const Recording recording = read(words[1]);
        std::ofstream out(words[2]);
        out.precision(17);  // stamps are compared with those of the recording
        Slam slam(recording.laser);
        for (const Reading& reading : recording.readings) {
            const Pose pose = slam.update(reading);
            out << reading.time << ' ' << pose.x << ' ' << pose.y << " 0 0 0 "
                << std::sin(pose.theta / 2) << ' ' << std::cos(pose.theta / 2) << '\n';
        }
        out.close();
        if (!out) throw std::runtime_error(std::string(words[2]) + ": cannot be written");
    } catch (const std::exception& error) {
        std::cerr << error.what() << '\n';
        return 1;
    }
    return 0;
}

}  // namespace driver
