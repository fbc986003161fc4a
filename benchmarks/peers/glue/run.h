/* The call that every contender answers. Inputs: position and velocity error x, vx, y, vy (m, m/s), and the last
 * commanded roll and pitch (rad). Output: roll and pitch of both moves (rad). Buffers that the caller must provide
 * are in the glue code and count. */
#ifdef __cplusplus
extern "C"
#endif
__attribute__((visibility("default"))) void run(const float error[4], const float last[2], float moves[4]);
