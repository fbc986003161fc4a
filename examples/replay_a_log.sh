# Did this firmware fly, with these inputs? Replay a log through the C, bit for bit; then one with a wrong setting.
#
# $ bash replay_a_log.sh
# all 2001 commands of the log are those of this controller, bit for bit
# NOT THIS CONTROLLER, or not its inputs: from 0.0 to 20.0 s roll is 2.3 mrad off,
set -u
mambo-nmpc design crazyflie -o controller.toml &> design.txt
mambo-nmpc fly controller.toml --sensors mocap --wind 2 --duration-s 20 -o flown &> flown.txt
mambo-nmpc replay flown/trace.csv controller.toml -o replayed 2> replay.txt | head -n 1

sed 's/^response_time_s = 0.*/response_time_s = 0.2/' controller.toml > other.toml
mambo-nmpc replay flown/trace.csv other.toml -o other 2> replay.txt | head -n 1
