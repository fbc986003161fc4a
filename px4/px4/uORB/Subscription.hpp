#include <px4.hpp>
