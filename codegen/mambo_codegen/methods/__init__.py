"""The methods of control, and what they share: target tracker, inputs, functions of numbers."""
