"""What a controller costs on a board, measured on the linked program: flash, static RAM, worst-case stack."""
