// The properties of the control loop where gains and the limit of the current are inputs.
`define CONTROL control_gains
`define GAINS
`include "control.sv"
