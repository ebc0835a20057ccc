mod boots;
