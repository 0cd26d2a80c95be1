"""What real sensors add to what perfect ones would say."""
