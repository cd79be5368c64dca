"""What a gearbox lacks, told before any work begins: parts that cannot be built, bodies that nothing holds."""
